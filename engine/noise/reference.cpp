#include "engine/noise/reference.h"

#include <cmath>

#include "engine/noise/normal.h"

namespace solidtex::engine::reference {

void plane(const StreamKey& key, Distribution distribution, const LatticePoints& points, int count,
           float* values) {
  const auto from_bits =
      distribution == Distribution::normal ? normal_from_bits : uniform_from_bits;
  for (int i = 0; i < count; ++i)
    values[i] = from_bits(solidtex_1_bits(key, points.x, static_cast<std::uint32_t>(points.y[i]),
                                          static_cast<std::uint32_t>(points.z[i])));
}

namespace {

float trilinear(const StreamKey& key, const LatticeCells& cells, int i) {
  const auto lerp = [](float t, float a, float b) { return std::fma(t, b - a, a); };
  const auto x = static_cast<std::uint32_t>(cells.corner[0][i]);
  const auto y = static_cast<std::uint32_t>(cells.corner[1][i]);
  const auto z = static_cast<std::uint32_t>(cells.corner[2][i]);
  const auto normal = [&](std::uint32_t dx, std::uint32_t dy, std::uint32_t dz) {
    return normal_from_bits(solidtex_1_bits(key, x + dx, y + dy, z + dz));
  };
  const auto along_z = [&](std::uint32_t dx, std::uint32_t dy) {
    return lerp(cells.fraction[2][i], normal(dx, dy, 0), normal(dx, dy, 1));
  };
  const auto along_y = [&](std::uint32_t dx) {
    return lerp(cells.fraction[1][i], along_z(dx, 0), along_z(dx, 1));
  };
  return lerp(cells.fraction[0][i], along_y(0), along_y(1));
}

}  // namespace

void trilinear_normal(const StreamKey& key, const LatticeCells& cells, int count, float* values) {
  for (int i = 0; i < count; ++i) values[i] = trilinear(key, cells, i);
}

void trilinear_normal_of_streams(const StreamKeys& keys, const LatticeCells& cells, int count,
                                 float* values) {
  for (int i = 0; i < count; ++i) {
    const StreamKey key{{keys.word[0][i], keys.word[1][i], keys.word[2][i], keys.word[3][i]}};
    values[i] = trilinear(key, cells, i);
  }
}

}  // namespace solidtex::engine::reference
