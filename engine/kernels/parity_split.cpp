#include "engine/kernels/parity_split.h"

namespace solidtex::engine {

namespace {

// One axis of a class: output `first` is reached by the taps first_tap, first_tap + 2 ...; tap
// first_tap reads input index `base`, the next tap base - 1.
struct AxisParity {
  std::int64_t first, count, base;
  int first_tap;
};

AxisParity parity_of(const TransposedShape& shape, int axis, int parity, std::int64_t size) {
  const std::int64_t reach = shape.out_lo[axis] + parity + shape.padding;
  const auto first_tap = static_cast<int>(reach & 1);
  return {parity, (size - parity + 1) / 2, ((reach - first_tap) >> 1) - shape.in_lo[axis],
          first_tap};
}

ParityClass make_class(const LinearLayer& layer, int kernel, const AxisParity (&axes)[3],
                       const ConstVolume& in) {
  ParityClass result;
  for (int axis = 0; axis < 3; ++axis) {
    result.first[axis] = axes[axis].first;
    result.count[axis] = axes[axis].count;
  }
  std::vector<int> terms;
  for (int c = 0; c < in.channels; ++c)
    for (int kx = axes[0].first_tap; kx < kernel; kx += 2)
      for (int ky = axes[1].first_tap; ky < kernel; ky += 2)
        for (int kz = axes[2].first_tap; kz < kernel; kz += 2) {
          terms.push_back(((c * kernel + kx) * kernel + ky) * kernel + kz);
          result.offsets.push_back(c * in.channel_pitch + (axes[0].base - kx / 2) * in.plane_pitch +
                                   (axes[1].base - ky / 2) * in.row_pitch + axes[2].base - kz / 2);
        }
  result.input = in.data;
  result.layer = LinearLayer(layer.outputs, static_cast<int>(terms.size()), layer.bias,
                             [&](int o, int t) { return layer.weight(o, terms[t]); });
  result.layer.negative_slope = layer.negative_slope;
  return result;
}

}  // namespace

std::vector<ParityClass> split_by_parity(const LinearLayer& layer, const TransposedShape& shape,
                                         const ConstVolume& in, const Volume& out) {
  std::vector<ParityClass> classes;
  for (int parity = 0; parity < 8; ++parity) {
    AxisParity axes[3];
    for (int axis = 0; axis < 3; ++axis)
      axes[axis] = parity_of(shape, axis, parity >> (2 - axis) & 1, out.size[axis]);
    if (axes[0].count > 0 && axes[1].count > 0 && axes[2].count > 0)
      classes.push_back(make_class(layer, shape.kernel, axes, in));
  }
  return classes;
}

}  // namespace solidtex::engine
