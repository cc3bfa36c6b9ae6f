#include "engine/lattice/operations.h"

#include <vector>

#include "engine/kernels/kernels.h"
#include "engine/noise/waves.h"

namespace solidtex::engine {

namespace {

template <class... Visitors>
struct Overloaded : Visitors... {
  using Visitors::operator()...;
};
template <class... Visitors>
Overloaded(Visitors...) -> Overloaded<Visitors...>;

// Lattice coordinates are taken modulo the period, and modulo 2^32.
std::uint32_t wrap(std::int64_t i, std::int64_t period) {
  if (period > 0) i = (i % period + period) % period;
  return static_cast<std::uint32_t>(i);
}

// The y and z of one parity of a plane, in the order of its values.
struct ParityPoints {
  ParityPoints(const Planes& planes, int parity, std::int64_t period) {
    const auto size = static_cast<std::size_t>(planes.rows * planes.row_pitch);
    y.reserve(size + kReadSlack);
    z.reserve(size + kReadSlack);
    for (std::int64_t row = 0; row < planes.rows; ++row)
      for (std::int64_t i = 0; i < planes.row_pitch; ++i) {
        y.push_back(static_cast<std::int32_t>(wrap(2 * (planes.y_lo + row) + parity / 2, period)));
        z.push_back(static_cast<std::int32_t>(wrap(2 * (planes.z_lo + i) + parity % 2, period)));
      }
    y.resize(size + kReadSlack);
    z.resize(size + kReadSlack);
  }
  std::vector<std::int32_t> y, z;
};

// Fills the planes [x_lo, x_hi) of a ring. `source` gives for a channel the function that writes
// its values at the points of a plane.
template <class Source>
void fill(const PlaneRing& ring, std::int64_t period, std::int64_t x_lo, std::int64_t x_hi,
          Source source) {
  const Planes& planes = ring.planes();
  for (int parity = 0; parity < 4; ++parity) {
    const ParityPoints points(planes, parity, period);
    for (int c = 0; c < planes.channels; ++c) {
      const auto write = source(c);
      for (std::int64_t x = x_lo; x < x_hi; ++x)
        write({wrap(x, period), points.y.data(), points.z.data()},
              static_cast<int>(planes.rows * planes.row_pitch),
              planes.plane(x) + (4 * c + parity) * planes.parity_pitch);
    }
  }
}

}  // namespace

void fill_noise(const LatticeNoise& noise, const PlaneRing& ring, std::int64_t x_lo,
                std::int64_t x_hi) {
  fill(ring, noise.period, x_lo, x_hi, [&](int c) {
    const NoiseStream stream(noise.scheme, noise.seed, static_cast<std::uint32_t>(noise.level),
                             static_cast<std::uint32_t>(c));
    return [stream, &noise](const LatticePoints& points, int count, float* values) {
      stream.plane(noise.distribution, points, count, values);
    };
  });
}

void fill_waves(const PeriodicOp& op, std::int64_t period, const PlaneRing& ring, std::int64_t x_lo,
                std::int64_t x_hi) {
  fill(ring, period, x_lo, x_hi, [&](int c) {
    return [wave = with_period(op.waves[static_cast<std::size_t>(c)], period)](
               const LatticePoints& points, int count, float* values) {
      waves(wave, points, count, values);
    };
  });
}

Block apply(const Node& node, const LinearLayer& layer, const Block& in, const Box& box) {
  // A result of the size of its input keeps the row pitch, so that planes are contiguous runs.
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
          [&](const LeakyReluOp& op) {
            kernels::leaky_relu(op.negative_slope, in.volume(), out.volume());
          },
          [&](const TanhOp&) { kernels::tanh(in.volume(), out.volume()); },
          [&](const SigmoidOp&) { kernels::sigmoid(in.volume(), out.volume()); },
          [&](const SoftmaxOp&) { kernels::softmax(in.volume(), out.volume()); },
          [](const auto&) {}},  // the others are computed elsewhere
      node.op);
  return out;
}

}  // namespace solidtex::engine
