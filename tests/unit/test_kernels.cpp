#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "catch.hpp"
#include "engine/kernels/kernels.h"
#include "engine/kernels/math.h"
#include "engine/lattice/block.h"
#include "tests/unit/block_values.h"
#include "tests/unit/every_target.h"

using namespace solidtex::engine;

namespace {

std::mt19937 random_bits(17);

float random_value() { return std::uniform_real_distribution<float>(-2, 2)(random_bits); }

LinearLayer random_layer(int outputs, int terms, float negative_slope) {
  std::vector<float> bias(static_cast<std::size_t>(outputs));
  for (float& b : bias) b = random_value();
  LinearLayer layer(outputs, terms, bias, [](int, int) { return random_value(); });
  layer.negative_slope = negative_slope;
  return layer;
}

Box box_of(std::int64_t x, std::int64_t y, std::int64_t z) { return {{0, 0, 0}, {x, y, z}}; }

Block random_block(const Box& box, int channels) {
  Block block(box, channels);
  const auto count = block.volume().channel_pitch * channels;
  for (std::ptrdiff_t i = 0; i < count; ++i) block.volume().data[i] = random_value();
  return block;
}

// Compares bits, those of zeros, infinities and NaN included.
bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

struct ConvCase {
  int inputs, outputs, kernel;
  std::int64_t x, y, z;  // size of the output
};

void check_conv3d(const ConvCase& c, bool same_pitch) {
  CAPTURE(c.inputs, c.outputs, c.kernel, c.x, c.y, c.z, same_pitch);
  const LinearLayer layer =
      random_layer(c.outputs, c.inputs * c.kernel * c.kernel * c.kernel, 0.125f);
  const Box in_box = box_of(c.x + c.kernel - 1, c.y + c.kernel - 1, c.z + c.kernel - 1);
  const Block in = random_block(in_box, c.inputs);
  const std::ptrdiff_t pitch = same_pitch ? in.volume().row_pitch : 0;
  Block expected(box_of(c.x, c.y, c.z), c.outputs, pitch);
  reference::conv3d(layer, c.kernel, in.volume(), expected.volume());
  testing::on_every_target([&] {
    Block found(box_of(c.x, c.y, c.z), c.outputs, pitch);
    kernels::conv3d(layer, c.kernel, in.volume(), found.volume());
    CHECK(same_bits(values_of(found), values_of(expected)));
  });
}

}  // namespace

TEST_CASE("conv3d is its reference bit for bit", "[kernels]") {
  for (const ConvCase& c : std::vector<ConvCase>{{1, 1, 1, 1, 1, 1},
                                                 {3, 4, 3, 1, 1, 1},
                                                 {5, 3, 3, 2, 3, 1},
                                                 {2, 7, 3, 3, 2, 5},
                                                 {4, 12, 1, 1, 5, 47},
                                                 {3, 24, 3, 2, 3, 49},
                                                 {7, 9, 5, 1, 2, 17},
                                                 {1, 33, 3, 1, 1, 131}}) {
    check_conv3d(c, true);
    check_conv3d(c, false);
  }
}

TEST_CASE("conv3d is a convolution", "[kernels]") {
  // One tap at a time: the output is the shifted input.
  const Block in = random_block(box_of(4, 5, 6), 2);
  for (int tap = 0; tap < 2 * 27; ++tap) {
    const LinearLayer layer(1, 2 * 27, {0.0f}, [&](int, int t) { return t == tap ? 1.0f : 0.0f; });
    Block out(box_of(2, 3, 4), 1);
    kernels::conv3d(layer, 3, in.volume(), out.volume());
    const int t = tap % 27;
    CHECK(out.volume().row(0, 1, 2)[3] ==
          in.volume().row(tap / 27, 1 + t / 9, 2 + t / 3 % 3)[3 + t % 3]);
  }
}

TEST_CASE("conv_transpose3d is its reference bit for bit", "[kernels]") {
  for (int kernel = 1; kernel <= 5; ++kernel)
    for (int padding = 0; padding < kernel; ++padding)
      for (const std::array<std::int64_t, 3> out_lo :
           {std::array<std::int64_t, 3>{0, 0, 0}, {-3, 5, -7}, {-4, -1, 100001}}) {
        const std::array<std::int64_t, 3> size{3, 4, 37};
        CAPTURE(kernel, padding, out_lo);
        // Input that contains every index of every tap.
        Box in_box, out_box;
        for (int axis = 0; axis < 3; ++axis) {
          out_box.lo[axis] = out_lo[axis];
          out_box.hi[axis] = out_lo[axis] + size[axis];
          in_box.lo[axis] = (out_box.lo[axis] - 8) >> 1;
          in_box.hi[axis] = (out_box.hi[axis] + 8) >> 1;
        }
        const LinearLayer layer = random_layer(6, 3 * kernel * kernel * kernel, 0.5f);
        const Block in = random_block(in_box, 3);
        Block expected(out_box, 6);
        const TransposedShape shape{kernel, padding, in_box.lo, out_box.lo};
        reference::conv_transpose3d(layer, shape, in.volume(), expected.volume());
        testing::on_every_target([&] {
          Block found(out_box, 6);
          kernels::conv_transpose3d(layer, shape, in.volume(), found.volume());
          CHECK(same_bits(values_of(found), values_of(expected)));
        });
      }
}

TEST_CASE("dense is its reference bit for bit, in blocks and for one point", "[kernels]") {
  constexpr std::ptrdiff_t pitch = 96;
  for (const auto& [inputs, outputs] : std::vector<std::pair<int, int>>{
           {1, 1}, {4, 128}, {13, 7}, {130, 33}, {0, 5}, {16, 16}, {9, 6}, {5, 257}}) {
    const float derivatives[] = {0.2f, 1.0f, 0.0f, 1.5f};
    const LinearLayer layer = random_layer(outputs, inputs, derivatives[outputs % 4]);
    const int written_outputs = (outputs + LinearLayer::kPack - 1) / 4 * 4;
    const Block in = random_block(box_of(1, 1, pitch), inputs);
    for (const int count : {1, 2, 15, 16, 17, 33, 47, 48, 49, 95, 96}) {
      CAPTURE(inputs, outputs, count);
      const int written =
          (count + kernels::kPointStep - 1) / kernels::kPointStep * kernels::kPointStep;
      const Block start = random_block(box_of(1, 1, pitch), written_outputs);
      std::vector<float> expected(pitch * static_cast<std::size_t>(outputs));
      reference::dense(layer, in.volume().data, count, pitch, expected.data());
      testing::on_every_target([&] {
        Block found(box_of(1, 1, pitch), written_outputs);
        std::copy_n(start.volume().data, pitch * written_outputs, found.volume().data);
        kernels::dense(layer, in.volume().data, count, pitch, found.volume().data);
        for (int o = 0; o < written_outputs; ++o) {
          const float* row = found.volume().data + o * pitch;
          if (o < outputs)
            CHECK(std::memcmp(row, &expected[o * pitch], sizeof(float) * count) == 0);
          const auto behind = static_cast<std::size_t>(pitch - written);
          CHECK(std::memcmp(row + written, start.volume().data + o * pitch + written,
                            sizeof(float) * behind) == 0);
        }
      });
    }
    std::vector<float> point(static_cast<std::size_t>(inputs)), expected(pitch * outputs);
    for (int t = 0; t < inputs; ++t) point[t] = in.volume().data[t * pitch];
    reference::dense(layer, in.volume().data, 1, pitch, expected.data());
    const PointLayer point_layer(layer);
    testing::on_every_target([&] {
      std::vector<float> found(static_cast<std::size_t>(point_layer.pitch));
      kernels::dense_point(point_layer, point.data(), found.data());
      for (int o = 0; o < outputs; ++o)
        CHECK(std::memcmp(&found[o], &expected[o * pitch], sizeof(float)) == 0);
    });
  }
}

TEST_CASE("activated derivatives are their reference bit for bit", "[kernels]") {
  constexpr std::ptrdiff_t unit_pitch = 64;
  for (const auto& [outputs, pitch] :
       std::vector<std::pair<int, int>>{{1, 16}, {7, 48}, {33, 32}}) {
    const LinearLayer layer = random_layer(outputs, 1, 0.2f);
    const Block units = random_block(box_of(1, 1, unit_pitch), outputs);
    const Block start = random_block(box_of(1, 3, pitch), outputs);
    const auto activated = [&](const auto& activate) {
      const float* first = start.volume().data;
      std::vector<float> derivatives(first, first + std::ptrdiff_t{3} * pitch * outputs);
      activate(layer, units.volume().data, unit_pitch, pitch, derivatives.data());
      return derivatives;
    };
    const std::vector<float> expected = activated(reference::activate_derivatives);
    CHECK(expected[0] == start.volume().data[0] * (units.volume().data[0] > 0 ? 1 : 0.2f));
    testing::on_every_target([&] { CHECK(activated(kernels::activate_derivatives) == expected); });
  }
}

namespace {

using Map = void (*)(const ConstVolume&, const Volume&);

void check_map(Map fast, Map slow, const Block& in) {
  Block expected(in.box(), in.volume().channels);
  slow(in.volume(), expected.volume());
  testing::on_every_target([&] {
    Block found(in.box(), in.volume().channels);
    fast(in.volume(), found.volume());
    CHECK(same_bits(values_of(found), values_of(expected)));
  });
}

void check_maps(const Block& in) {
  check_map(kernels::tanh, reference::tanh, in);
  check_map(kernels::sigmoid, reference::sigmoid, in);
  check_map(kernels::softmax, reference::softmax, in);
  check_map([](const ConstVolume& a, const Volume& b) { kernels::leaky_relu(0.01f, a, b); },
            [](const ConstVolume& a, const Volume& b) { reference::leaky_relu(0.01f, a, b); }, in);
  static const float scale[] = {1.5f, -0.3f, 0.7f}, shift[] = {0.1f, 2.0f, -3.0f};
  check_map([](const ConstVolume& a, const Volume& b) { kernels::affine(scale, shift, a, b); },
            [](const ConstVolume& a, const Volume& b) { reference::affine(scale, shift, a, b); },
            in);
}

}  // namespace

TEST_CASE("element-wise kernels are their references bit for bit", "[kernels]") {
  for (const Box& box : {box_of(1, 1, 1), box_of(2, 3, 5), box_of(1, 2, 67)})
    check_maps(random_block(box, 3));
  Block wide = random_block(box_of(7, 11, 131), 3);  // many magnitudes
  const auto count = 3 * wide.volume().channel_pitch;
  for (std::ptrdiff_t i = 0; i < count; ++i)
    wide.volume().data[i] *= std::exp2(static_cast<float>(i % 40 - 20));
  const float special[] = {0.0f,
                           -0.0f,
                           0.625f,
                           -0.625f,
                           87.0f,
                           -87.0f,
                           1e30f,
                           -1e30f,
                           1e-40f,
                           std::numeric_limits<float>::infinity(),
                           -std::numeric_limits<float>::infinity()};
  std::copy(std::begin(special), std::end(special), wide.volume().data);
  check_maps(wide);
}

TEST_CASE("softmax is its reference bit for bit, for any number of phases", "[kernels]") {
  for (const int phases : {1, 2, 5, 8})
    for (const Box& box : {box_of(1, 1, 1), box_of(3, 2, 33)})
      check_map(kernels::softmax, reference::softmax, random_block(box, phases));
}

TEST_CASE("softmax is as accurate as docs/numerics.md says", "[kernels]") {
  constexpr int phases = 3, count = 4096;
  Block in = random_block(box_of(1, 1, count), phases);
  const Volume logits = in.volume();
  for (int c = 0; c < phases; ++c)
    for (int z = 0; z < count; ++z) logits.row(c, 0, 0)[z] *= static_cast<float>(z % 64);
  Block found(in.box(), phases);
  kernels::softmax(logits, found.volume());
  double error = 0;
  for (int z = 0; z < count; ++z) {
    double sum = 0;
    for (int c = 0; c < phases; ++c) sum += std::exp(double{logits.row(c, 0, 0)[z]});
    for (int c = 0; c < phases; ++c) {
      const double expected = std::exp(double{logits.row(c, 0, 0)[z]}) / sum;
      error = std::max(error, std::fabs(found.volume().row(c, 0, 0)[z] - expected));
    }
  }
  CHECK(error < 1.5e-7);
  WARN("largest error: softmax " << error);
}

TEST_CASE("sines are as accurate as docs/numerics.md says, and exact at quarters", "[kernels]") {
  constexpr double kTurn = 6.283185307179586;
  double error = 0;
  for (std::uint64_t angle = 0; angle < (1ull << 32); angle += 1021) {
    const double expected = std::sin(kTurn * static_cast<double>(angle) * 0x1p-32);
    const float found = solidtex::engine::sine_of_turn(static_cast<std::uint32_t>(angle));
    error = std::max(error, std::fabs(found - expected));
  }
  CHECK(error < 1.0e-7);
  WARN("largest error: sine " << error);
  const float quarters[] = {0, 1, 0, -1};
  for (std::uint32_t i = 0; i < 4; ++i)
    CHECK(solidtex::engine::sine_of_turn(i * 0x40000000u) == quarters[i]);
}

TEST_CASE("tanh and sigmoid are as accurate as docs/numerics.md says", "[kernels]") {
  double tanh_error = 0, sigmoid_error = 0;
  for (int i = -2'000'000; i <= 2'000'000; ++i) {
    const float x = static_cast<float>(i) * 1e-5f;
    tanh_error = std::max(tanh_error, std::fabs(solidtex::engine::tanh(x) - std::tanh(double{x})));
    sigmoid_error = std::max(
        sigmoid_error, std::fabs(solidtex::engine::sigmoid(x) - 1 / (1 + std::exp(-double{x}))));
  }
  CHECK(tanh_error < 1.0e-7);
  CHECK(sigmoid_error < 1.0e-7);
  WARN("largest error: tanh " << tanh_error << ", sigmoid " << sigmoid_error);
}
