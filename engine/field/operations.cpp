#include "engine/field/operations.h"

#include <vector>

#include "engine/kernels/kernels.h"

namespace solidtex::engine {

namespace {

template <class... Visitors>
struct Overloaded : Visitors... {
  using Visitors::operator()...;
};
template <class... Visitors>
Overloaded(Visitors...) -> Overloaded<Visitors...>;

// Lattice coordinates are taken modulo 2^32.
std::int32_t wrap(std::int64_t i) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(i));
}

}  // namespace

void fill_noise(const NoiseField& noise, const Window& window, const Box& box) {
  std::vector<float> row(static_cast<std::size_t>(box.size(2)));
  for (int c = 0; c < window.planes().channels; ++c) {
    const NoiseStream stream(noise.scheme, noise.seed, static_cast<std::uint32_t>(noise.level),
                             static_cast<std::uint32_t>(c));
    for (std::int64_t x = box.lo[0]; x < box.hi[0]; ++x)
      for (std::int64_t y = box.lo[1]; y < box.hi[1]; ++y) {
        stream.row(noise.distribution, wrap(x), wrap(y), wrap(box.lo[2]),
                   static_cast<int>(box.size(2)), row.data());
        window.write(c, x, y, box.lo[2], box.hi[2], row.data());
      }
  }
}

Block apply(const Node& node, const LinearLayer& layer, const Block& in, const Box& box) {
  // Results of the size of their input keep its row pitch, so that planes are single runs.
  const bool same_size = in.box().size(2) == box.size(2);
  Block out(box, node.channels, same_size ? in.volume().row_pitch : 0);
  std::visit(
      Overloaded{
          [&](const Conv3dOp& op) { kernels::conv3d(layer, op.kernel, in.volume(), out.volume()); },
          [&](const ConvTranspose3dOp& op) {
            kernels::conv_transpose3d(layer, {op.kernel, op.padding, in.box().lo, box.lo},
                                      in.volume(), out.volume());
          },
          [&](const AffineOp& op) {
            kernels::affine(op.scale.values.data(), op.shift.values.data(), in.volume(),
                            out.volume());
          },
          [&](const LeakyReluOp& op) { kernels::leaky_relu(op.slope, in.volume(), out.volume()); },
          [&](const TanhOp&) { kernels::tanh(in.volume(), out.volume()); },
          [&](const SigmoidOp&) { kernels::sigmoid(in.volume(), out.volume()); },
          [](const auto&) {}},  // noise, upsampling and concatenation are no such operations
      node.op);
  return out;
}

}  // namespace solidtex::engine
