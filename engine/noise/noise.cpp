#include "engine/noise/noise.h"

#include "engine/common/error.h"
#include "engine/noise/normal.h"
#include "engine/noise/solidtex_1.h"

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

void NoiseStream::plane(Distribution distribution, const LatticePoints& points, int count,
                        float* values) const {
  if (distribution == Distribution::normal) require_normal(scheme_);
  if (scheme_ == NoiseScheme::solidtex_1)
    return solidtex_1::plane(key_, distribution, points, count, values);
  for (int i = 0; i < count; ++i)
    values[i] = uniform(static_cast<std::int32_t>(points.x), points.y[i], points.z[i]);
}

void require_normal(NoiseScheme scheme) {
  if (scheme == NoiseScheme::solidtex_1) return;
  throw Error(SOLIDTEX_INVALID_MODEL,
              "noise scheme solidtexturenets is uniform only, found distribution normal, expected "
              "uniform");
}

}  // namespace solidtex::engine
