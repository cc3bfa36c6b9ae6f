// View of planar channels on a dense grid: input and output of kernels.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace solidtex::engine {

// Value (c, x, y, z) is data[c * channel_pitch + x * plane_pitch + y * row_pitch + z]. Rows may be
// longer than size[2]; vector kernels may write between them.
template <class Value>
struct BasicVolume {
  Value* data = nullptr;
  int channels = 0;
  std::array<std::int64_t, 3> size{};
  std::ptrdiff_t channel_pitch = 0, plane_pitch = 0, row_pitch = 0;

  Value* row(int c, std::int64_t x, std::int64_t y) const {
    return data + c * channel_pitch + x * plane_pitch + y * row_pitch;
  }
};

struct Volume : BasicVolume<float> {};

struct ConstVolume : BasicVolume<const float> {
  ConstVolume() = default;
  ConstVolume(const Volume& v)
      : BasicVolume{v.data, v.channels, v.size, v.channel_pitch, v.plane_pitch, v.row_pitch} {}
};

// Vector kernels may read this many floats beyond their input.
inline constexpr std::size_t kReadSlack = 64;

}  // namespace solidtex::engine
