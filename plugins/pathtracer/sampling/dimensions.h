// Which random numbers of a path are for what.
#pragma once

#include <cstdint>

namespace solidtex::pathtracer {

// Random numbers of one bounce, counted from dimension(depth).
enum Dimension : std::uint32_t { kLight, kLobe, kDirection, kRoulette, kCount };
inline constexpr std::uint32_t kPixel = 0, kLens = 1, kFirstBounce = 2;

inline std::uint32_t dimension(int depth) {
  return kFirstBounce + static_cast<std::uint32_t>(depth - 1) * kCount;
}

// Of stochastic filtering, far from the others, which therefore do not change with it.
inline constexpr std::uint32_t kJitter = 1u << 24;

}  // namespace solidtex::pathtracer
