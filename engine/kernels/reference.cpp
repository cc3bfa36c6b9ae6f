#include "engine/kernels/reference.h"

#include <algorithm>
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

}  // namespace

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
  // Returns twice the input index, relative to in_lo, that tap t of output index o reads.
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
    out[o] = sum > 0 ? sum : layer.negative_slope * sum;
  }
}

void activate_derivatives(const LinearLayer& layer, const float* units, std::ptrdiff_t unit_pitch,
                          std::ptrdiff_t pitch, float* derivatives) {
  for (int o = 0; o < layer.outputs; ++o, units += unit_pitch)
    for (int axis = 0; axis < 3; ++axis, derivatives += pitch)
      for (std::ptrdiff_t p = 0; p < pitch; ++p)
        derivatives[p] *= units[p] > 0 ? 1 : layer.negative_slope;
}

void affine(const float* scale, const float* shift, const ConstVolume& in, const Volume& out) {
  map(in, out, [&](int c, float v) { return std::fma(scale[c], v, shift[c]); });
}

void leaky_relu(float negative_slope, const ConstVolume& in, const Volume& out) {
  map(in, out, [&](int, float v) { return v > 0 ? v : negative_slope * v; });
}

void tanh(const ConstVolume& in, const Volume& out) {
  map(in, out, [](int, float v) { return engine::tanh(v); });
}

void sigmoid(const ConstVolume& in, const Volume& out) {
  map(in, out, [](int, float v) { return engine::sigmoid(v); });
}

void softmax(const ConstVolume& in, const Volume& out) {
  for_each_voxel(out, [&](int c, std::int64_t x, std::int64_t y, std::int64_t z) {
    if (c > 0) return;  // all channels of a voxel at once
    float most = in.row(0, x, y)[z], sum = 0;
    for (int i = 1; i < in.channels; ++i) most = std::max(most, in.row(i, x, y)[z]);
    for (int i = 0; i < in.channels; ++i) sum += exp_negative(most - in.row(i, x, y)[z]);
    for (int i = 0; i < in.channels; ++i)
      out.row(i, x, y)[z] = exp_negative(most - in.row(i, x, y)[z]) / sum;
  });
}

}  // namespace solidtex::engine::reference
