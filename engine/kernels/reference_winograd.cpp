// Winograd's minimal filtering as plain loops. See reference.h.
#include <cmath>
#include <vector>

#include "engine/kernels/reference.h"

namespace solidtex::engine::reference {

namespace {

// B^T d of F(2, 3).
void transform_input_2(float* d) {
  const float d0 = d[0], d1 = d[1], d2 = d[2], d3 = d[3];
  d[0] = d0 - d2, d[1] = d1 + d2, d[2] = d2 - d1, d[3] = d1 - d3;
}

// B^T d of an upsampled input: pairs of equal values. See WinogradLayer.
void transform_upsampled(float* d) {
  const float a = d[1], b = d[2];
  d[0] = a - b, d[1] = a + b, d[2] = 0, d[3] = a - b;
}

// B^T d of F(4, 3). Products with powers of two are exact.
void transform_input_4(float* d) {
  const float d0 = d[0], d1 = d[1], d2 = d[2], d3 = d[3], d4 = d[4], d5 = d[5];
  d[0] = 4 * (d0 - d2) + (d4 - d2);
  d[1] = (d4 - 4 * d2) + (d3 - 4 * d1);
  d[2] = (d4 - 4 * d2) - (d3 - 4 * d1);
  d[3] = 2 * (d3 - d1) + (d4 - d2);
  d[4] = (d4 - d2) - 2 * (d3 - d1);
  d[5] = (d5 - d3) - 4 * (d3 - d1);
}

// A^T m of F(2, 3), one of its outputs.
float output_2(const float* m, int i) {
  return i == 0 ? (m[0] + m[1]) + m[2] : (m[1] - m[2]) - m[3];
}

// A^T m of F(4, 3), one of its outputs.
float output_4(const float* m, int i) {
  if (i == 0) return (m[0] + (m[1] + m[2])) + (m[3] + m[4]);
  if (i == 1) return (m[1] - m[2]) + 2 * (m[3] - m[4]);
  if (i == 2) return (m[1] + m[2]) + 4 * (m[3] + m[4]);
  return ((m[1] - m[2]) + 8 * (m[3] - m[4])) + m[5];
}

// Values of a tile: (tile + 2) x 4 x 4.
struct Tile {
  explicit Tile(int tile_size, bool is_upsampled = false)
      : tile(tile_size),
        positions(tile + 2),
        upsampled(is_upsampled),
        values(static_cast<std::size_t>(16 * positions)) {}
  float& at(int x, int y, int z) { return values[16 * x + 4 * y + z]; }

  // Transforms `count` values that are `step` apart.
  void transform_input(float* first, int count, int step) {
    float d[6] = {};
    for (int i = 0; i < count; ++i) d[i] = first[i * step];
    if (upsampled)
      transform_upsampled(d);
    else
      count == 4 ? transform_input_2(d) : transform_input_4(d);
    for (int i = 0; i < count; ++i) first[i * step] = d[i];
  }

  int tile, positions;
  bool upsampled;
  std::vector<float> values;
};

// Returns the inputs of a tile, transformed along z, then y, then x. `corner` is the position of
// its first input in the volume. No output of the volume needs what lies outside.
Tile transformed_input(const ConstVolume& in, int channel, Tile d,
                       const std::array<std::int64_t, 3>& corner) {
  const int n = d.positions;
  for (int x = 0; x < n; ++x)
    for (int y = 0; y < 4; ++y)
      for (int z = 0; z < 4; ++z) {
        const std::int64_t at[3] = {corner[0] + x, corner[1] + y, corner[2] + z};
        bool inside = true;
        for (int axis = 0; axis < 3; ++axis) inside &= at[axis] >= 0 && at[axis] < in.size[axis];
        if (inside) d.at(x, y, z) = in.row(channel, at[0], at[1])[at[2]];
      }
  for (int x = 0; x < n; ++x)
    for (int y = 0; y < 4; ++y) d.transform_input(&d.at(x, y, 0), 4, 1);
  for (int x = 0; x < n; ++x)
    for (int z = 0; z < 4; ++z) d.transform_input(&d.at(x, 0, z), 4, 4);
  for (int y = 0; y < 4; ++y)
    for (int z = 0; z < 4; ++z) d.transform_input(&d.at(0, y, z), n, 16);
  return d;
}

// Returns one output of a tile from its products, transformed along z, then y, then x.
float transformed_output(Tile& m, const std::array<int, 3>& voxel) {
  float along_x[6], along_y[4];
  for (int x = 0; x < m.positions; ++x) {
    for (int y = 0; y < 4; ++y) along_y[y] = output_2(&m.at(x, y, 0), voxel[2]);
    along_x[x] = output_2(along_y, voxel[1]);
  }
  return m.tile == 2 ? output_2(along_x, voxel[0]) : output_4(along_x, voxel[0]);
}

}  // namespace

void winograd_conv3d(const WinogradLayer& layer, int origin,
                     const std::array<std::int64_t, 3>& out_lo, const ConstVolume& in,
                     const Volume& out) {
  const std::int64_t last[3] = {layer.tile - 1, 1, 1};  // of a tile
  for (int o = 0; o < out.channels; ++o)
    for (std::int64_t x = 0; x < out.size[0]; ++x)
      for (std::int64_t y = 0; y < out.size[1]; ++y)
        for (std::int64_t z = 0; z < out.size[2]; ++z) {
          std::array<std::int64_t, 3> corner{x, y, z};
          std::array<int, 3> voxel;
          for (int axis = 0; axis < 3; ++axis) {
            voxel[axis] = static_cast<int>((out_lo[axis] + corner[axis] - origin) & last[axis]);
            corner[axis] -= voxel[axis];  // the input begins one voxel before the output
          }
          Tile products(layer.tile);
          for (int c = 0; c < layer.inputs(); ++c) {
            const Tile d = transformed_input(in, c, Tile(layer.tile, layer.upsampled[c]), corner);
            for (std::size_t p = 0; p < d.values.size(); ++p)
              products.values[p] = std::fma(layer.at(static_cast<int>(p / 4), c)[4 * o + p % 4],
                                            d.values[p], products.values[p]);
          }
          const float sum = transformed_output(products, voxel) + layer.bias[o];
          out.row(o, x, y)[z] = sum > 0 ? sum : layer.negative_slope * sum;
        }
}

}  // namespace solidtex::engine::reference
