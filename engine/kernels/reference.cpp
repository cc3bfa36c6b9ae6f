#include "engine/kernels/reference.h"

#include <cmath>

#include "engine/kernels/math.h"

namespace solidtex::engine::reference {

namespace {

template <class Visit>
void for_each_voxel(const Volume& out, Visit visit) {
  for (int c = 0; c < out.channels; ++c)
    for (std::int64_t x = 0; x < out.size[0]; ++x)
      for (std::int64_t y = 0; y < out.size[1]; ++y)
        for (std::int64_t z = 0; z < out.size[2]; ++z) visit(c, x, y, z);
}

template <class Function>
void map(const ConstVolume& in, const Volume& out, Function function) {
  for_each_voxel(out, [&](int c, std::int64_t x, std::int64_t y, std::int64_t z) {
    out.row(c, x, y)[z] = function(c, in.row(c, x, y)[z]);
  });
}

// Replaces the four values at stride `step` by B^T d of F(2, 3).
void transform_input(float* d, int step) {
  const float d0 = d[0], d1 = d[step], d2 = d[2 * step], d3 = d[3 * step];
  d[0] = d0 - d2, d[step] = d1 + d2, d[2 * step] = d2 - d1, d[3 * step] = d1 - d3;
}

// A^T m of F(2, 3), one of its two outputs.
float transform_output(const float* m, int step, int parity) {
  return parity == 0 ? (m[0] + m[step]) + m[2 * step] : (m[step] - m[2 * step]) - m[3 * step];
}

using Tile = std::array<float, kWinogradPositions>;

// The 4^3 inputs of a tile, transformed along z, then x, then y. `corner` is the place of its first
// input relative to the volume; what lies outside is needed by none of the volume's outputs.
Tile transformed_input(const ConstVolume& in, int channel,
                       const std::array<std::int64_t, 3>& corner) {
  Tile d{};
  for (int i = 0; i < kWinogradPositions; ++i) {
    const std::int64_t at[3] = {corner[0] + i / 16, corner[1] + i / 4 % 4, corner[2] + i % 4};
    bool inside = true;
    for (int axis = 0; axis < 3; ++axis) inside &= at[axis] >= 0 && at[axis] < in.size[axis];
    if (inside) d[i] = in.row(channel, at[0], at[1])[at[2]];
  }
  for (const int step : {1, 16, 4})
    for (int i = 0; i < kWinogradPositions; ++i)
      if (i / step % 4 == 0) transform_input(&d[i], step);
  return d;
}

// One output of a tile from its products, transformed along z, then y, then x.
float transformed_output(const Tile& m, const std::array<int, 3>& parity) {
  float along_x[4];
  for (int x = 0; x < 4; ++x) {
    float along_y[4];
    for (int y = 0; y < 4; ++y) along_y[y] = transform_output(&m[16 * x + 4 * y], 1, parity[2]);
    along_x[x] = transform_output(along_y, 1, parity[1]);
  }
  return transform_output(along_x, 1, parity[0]);
}

}  // namespace

void winograd_conv3d(const WinogradLayer& layer, const std::array<std::int64_t, 3>& out_lo,
                     const ConstVolume& in, const Volume& out) {
  for_each_voxel(out, [&](int o, std::int64_t x, std::int64_t y, std::int64_t z) {
    std::array<std::int64_t, 3> corner{x, y, z};
    std::array<int, 3> parity;
    for (int axis = 0; axis < 3; ++axis) {
      parity[axis] = static_cast<int>((out_lo[axis] + corner[axis]) & 1);
      corner[axis] -= parity[axis];  // the input begins one voxel before the output
    }
    Tile products{};
    for (int c = 0; c < layer.inputs; ++c) {
      const Tile d = transformed_input(in, c, corner);
      for (int p = 0; p < kWinogradPositions; ++p)
        products[p] = std::fma(layer.at(p / 4, c)[4 * o + p % 4], d[p], products[p]);
    }
    const float sum = transformed_output(products, parity) + layer.bias[o];
    out.row(o, x, y)[z] = sum > 0 ? sum : layer.slope * sum;
  });
}

void conv3d(const LinearLayer& layer, int kernel, const ConstVolume& in, const Volume& out) {
  for_each_voxel(out, [&](int o, std::int64_t x, std::int64_t y, std::int64_t z) {
    float sum = layer.bias[o];
    int term = 0;
    for (int c = 0; c < in.channels; ++c)
      for (int kx = 0; kx < kernel; ++kx)
        for (int ky = 0; ky < kernel; ++ky)
          for (int kz = 0; kz < kernel; ++kz)
            sum = std::fma(layer.weight(o, term++), in.row(c, x + kx, y + ky)[z + kz], sum);
    out.row(o, x, y)[z] = layer.activate(sum);
  });
}

void conv_transpose3d(const LinearLayer& layer, const TransposedShape& shape, const ConstVolume& in,
                      const Volume& out) {
  // Twice the input index (relative to in_lo) that tap t of output index o falls on.
  const auto doubled = [&](int axis, std::int64_t o, int t) {
    return shape.out_lo[axis] + o + shape.padding - t - 2 * shape.in_lo[axis];
  };
  for_each_voxel(out, [&](int o, std::int64_t x, std::int64_t y, std::int64_t z) {
    float sum = layer.bias[o];
    int term = 0;
    for (int c = 0; c < in.channels; ++c)
      for (int kx = 0; kx < shape.kernel; ++kx)
        for (int ky = 0; ky < shape.kernel; ++ky)
          for (int kz = 0; kz < shape.kernel; ++kz, ++term) {
            const std::int64_t ix = doubled(0, x, kx), iy = doubled(1, y, ky),
                               iz = doubled(2, z, kz);
            if (((ix | iy | iz) & 1) != 0) continue;
            sum = std::fma(layer.weight(o, term), in.row(c, ix / 2, iy / 2)[iz / 2], sum);
          }
    out.row(o, x, y)[z] = layer.activate(sum);
  });
}

void dense(const LinearLayer& layer, const float* in, int count, std::ptrdiff_t pitch, float* out) {
  for (int o = 0; o < layer.outputs; ++o)
    for (int p = 0; p < count; ++p) {
      float sum = layer.bias[o];
      for (int t = 0; t < layer.terms; ++t)
        sum = std::fma(layer.weight(o, t), in[t * pitch + p], sum);
      out[o * pitch + p] = layer.activate(sum);
    }
}

void dense_point(const PointLayer& layer, const float* in, float* out) {
  for (std::ptrdiff_t o = 0; o < layer.pitch; ++o) {
    float sum = layer.bias[o];
    for (int t = 0; t < layer.terms; ++t)
      sum = std::fma(layer.weights[t * layer.pitch + o], in[t], sum);
    out[o] = sum > 0 ? sum : layer.slope * sum;
  }
}

void affine(const float* scale, const float* shift, const ConstVolume& in, const Volume& out) {
  map(in, out, [&](int c, float v) { return std::fma(scale[c], v, shift[c]); });
}

void leaky_relu(float slope, const ConstVolume& in, const Volume& out) {
  map(in, out, [&](int, float v) { return v > 0 ? v : slope * v; });
}

void tanh(const ConstVolume& in, const Volume& out) {
  map(in, out, [](int, float v) { return engine::tanh(v); });
}

void sigmoid(const ConstVolume& in, const Volume& out) {
  map(in, out, [](int, float v) { return engine::sigmoid(v); });
}

}  // namespace solidtex::engine::reference
