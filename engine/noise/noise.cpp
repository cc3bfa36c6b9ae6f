#include "engine/noise/noise.h"

#include <cmath>

#include "engine/model/error.h"
#include "engine/noise/normal.h"

namespace solidtex::engine {

NoiseStream::NoiseStream(NoiseScheme scheme, std::uint64_t seed, std::uint32_t level,
                         std::uint32_t channel)
    : scheme_(scheme),
      seed_(seed),
      level_(level),
      channel_(channel),
      key_(make_stream_key(seed, level, channel)) {}

float NoiseStream::uniform(std::int32_t x, std::int32_t y, std::int32_t z) const {
  const auto ux = static_cast<std::uint32_t>(x), uy = static_cast<std::uint32_t>(y),
             uz = static_cast<std::uint32_t>(z);
  if (scheme_ == NoiseScheme::solidtex_1)
    return uniform_from_bits(solidtex_1_bits(key_, ux, uy, uz));
  return static_cast<float>(solidtexturenets_bits(seed_, level_, channel_, ux, uy, uz)) * 0x1p-64f;
}

float NoiseStream::normal(std::int32_t x, std::int32_t y, std::int32_t z) const {
  require_normal(scheme_);
  return normal_from_bits(solidtex_1_bits(key_, static_cast<std::uint32_t>(x),
                                          static_cast<std::uint32_t>(y),
                                          static_cast<std::uint32_t>(z)));
}

void NoiseStream::row(Distribution distribution, std::int32_t x, std::int32_t y, std::int32_t z,
                      int count, float* values) const {
  for (int i = 0; i < count; ++i) {
    const auto zi = static_cast<std::int32_t>(static_cast<std::uint32_t>(z) + i);
    values[i] = distribution == Distribution::normal ? normal(x, y, zi) : uniform(x, y, zi);
  }
}

void NoiseStream::trilinear_normal(const std::int32_t* x, const std::int32_t* y,
                                   const std::int32_t* z, const float* fx, const float* fy,
                                   const float* fz, int count, float* values) const {
  const auto next = [](std::int32_t i) {
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(i) + 1);
  };
  const auto lerp = [](float t, float a, float b) { return std::fma(t, b - a, a); };
  for (int i = 0; i < count; ++i) {
    const auto along_z = [&](std::int32_t xi, std::int32_t yi) {
      return lerp(fz[i], normal(xi, yi, z[i]), normal(xi, yi, next(z[i])));
    };
    const auto along_y = [&](std::int32_t xi) {
      return lerp(fy[i], along_z(xi, y[i]), along_z(xi, next(y[i])));
    };
    values[i] = lerp(fx[i], along_y(x[i]), along_y(next(x[i])));
  }
}

void require_normal(NoiseScheme scheme) {
  if (scheme == NoiseScheme::solidtex_1) return;
  throw Error(SOLIDTEX_INVALID_MODEL,
              "noise scheme solidtexturenets is uniform only, found distribution normal, expected "
              "uniform");
}

}  // namespace solidtex::engine
