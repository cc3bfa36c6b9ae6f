#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "catch.hpp"
#include "engine/kernels/reference.h"
#include "engine/kernels/winograd.h"
#include "engine/lattice/plane_ring.h"
#include "tests/unit/block_values.h"
#include "tests/unit/every_target.h"

using namespace solidtex::engine;

namespace {

std::mt19937 random_bits(23);

std::vector<float> random_values(std::size_t count, float size) {
  std::uniform_real_distribution<float> value(-size, size);
  std::vector<float> values(count);
  for (float& v : values) v = value(random_bits);
  return values;
}

Block random_block(const Box& box, int channels) {
  Block block(box, channels);
  const auto count = static_cast<std::size_t>(block.volume().channel_pitch * channels);
  std::ranges::copy(random_values(count, 2), block.volume().data);
  return block;
}

// Returns the box with `margin` more cells on every side.
Box grown(Box box, std::int64_t margin) {
  for (int axis = 0; axis < 3; ++axis) {
    box.lo[axis] -= margin;
    box.hi[axis] += margin;
  }
  return box;
}

// A plane ring of a box, with its memory.
struct Store {
  Store(const Box& box, int channels, int parities)
      : window(box, channels, parities, box.size(0)), memory(window.memory(), 0.5f) {
    window.use(memory.data());
    window.slide(box.lo[0], box.hi[0]);
  }
  Store(const Block& block, int parities) : Store(block.box(), block.volume().channels, parities) {
    const Box& box = block.box();
    for (int c = 0; c < block.volume().channels; ++c)
      for (auto x = box.lo[0]; x < box.hi[0]; ++x)
        for (auto y = box.lo[1]; y < box.hi[1]; ++y)
          window.write(c, x, y, box.lo[2], box.hi[2],
                       block.volume().row(c, x - box.lo[0], y - box.lo[1]));
  }
  PlaneRing window;
  std::vector<float> memory;
};

std::vector<float> values_of(const PlaneRing& window, const Box& box) {
  std::vector<float> values, row(static_cast<std::size_t>(box.size(2)));
  for (int c = 0; c < window.planes().channels; ++c)
    for (auto x = box.lo[0]; x < box.hi[0]; ++x)
      for (auto y = box.lo[1]; y < box.hi[1]; ++y) {
        window.read(c, x, y, box.lo[2], box.hi[2], row.data());
        values.insert(values.end(), row.begin(), row.end());
      }
  return values;
}

struct Source {
  int channels;
  bool upsampled;
};

struct ConvCase {
  std::vector<Source> sources;
  std::vector<int> outputs;  // outputs of the 3^3 convolution and of the 1^3 ones after it
  std::array<std::int64_t, 3> lo, size;
  int tile = 2;    // along x; 1 sums tap by tap
  int wider = 0;   // extra voxels of the last source along z
  int origin = 0;  // of tiles

  Box box() const { return {lo, {lo[0] + size[0], lo[1] + size[1], lo[2] + size[2]}}; }
  int inputs() const { return static_cast<int>(upsampled().size()); }
  std::vector<bool> upsampled() const {
    std::vector<bool> inputs;
    for (const Source& source : sources)
      inputs.insert(inputs.end(), source.channels, source.upsampled);
    return inputs;
  }
};

ConvChain random_chain(const ConvCase& c) {
  const auto floats = [](int a, int b) { return static_cast<std::size_t>(a) * b; };
  ConvChain chain;
  chain.origin = c.origin;
  int inputs = c.inputs();
  for (const int outputs : c.outputs) {
    const auto bias = random_values(static_cast<std::size_t>(outputs), 1);
    if (chain.outputs() == 0) {
      const auto weights = random_values(floats(inputs, outputs) * 27, 1);
      if (c.tile == 1)
        chain.taps = LinearLayer(outputs, inputs * 27, bias,
                                 [&](int o, int t) { return weights[o * inputs * 27 + t]; });
      else
        chain.first = WinogradLayer(c.tile, c.upsampled(), outputs, weights, bias);
      chain.first.negative_slope = chain.taps.negative_slope = 0.25f;
    } else {
      chain.rest.emplace_back(inputs, outputs, random_values(floats(inputs, outputs), 1), bias);
      chain.rest.back().negative_slope = 0.5f;
    }
    inputs = outputs;
  }
  return chain;
}

// The chain computed by the reference loops.
Block expected_block(const ConvChain& chain, const Block& in, const Box& box) {
  Block out(box, chain.is_direct() ? chain.taps.outputs : chain.first.outputs);
  if (chain.is_direct())
    reference::conv3d(chain.taps, 3, in.volume(), out.volume());
  else
    reference::winograd_conv3d(chain.first, chain.origin, box.lo, in.volume(), out.volume());
  for (const ChannelLayer& layer : chain.rest) {
    LinearLayer linear(layer.outputs, layer.inputs, layer.bias,
                       [&](int o, int i) { return layer.weights[i * layer.padded + o]; });
    linear.negative_slope = layer.negative_slope;
    Block next(box, layer.outputs);
    reference::conv3d(linear, 1, out.volume(), next.volume());
    out = std::move(next);
  }
  return out;
}

void check(const ConvCase& c) {
  CAPTURE(c.inputs(), c.outputs, c.lo, c.size);
  const ConvChain chain = random_chain(c);
  const Box needed = grown(c.box(), 1);
  Block in(needed, c.inputs());
  std::vector<Store> stores;
  int channel = 0;
  for (const Source& source : c.sources) {
    Box kept = needed;
    if (source.upsampled)
      for (int axis = 0; axis < 3; ++axis) {
        kept.lo[axis] >>= 1;
        kept.hi[axis] = (kept.hi[axis] + 1) >> 1;
      }
    else if (&source == &c.sources.back())
      kept.hi[2] += c.wider;
    const Block block = random_block(kept, source.channels);
    stores.emplace_back(block, source.upsampled ? 1 : 4);
    for (int i = 0; i < source.channels; ++i, ++channel)
      for (auto x = needed.lo[0]; x < needed.hi[0]; ++x)
        for (auto y = needed.lo[1]; y < needed.hi[1]; ++y)
          for (auto z = needed.lo[2]; z < needed.hi[2]; ++z) {
            const int step = source.upsampled ? 1 : 0;
            in.volume().row(channel, x - needed.lo[0], y - needed.lo[1])[z - needed.lo[2]] =
                block.volume().row(i, (x >> step) - kept.lo[0],
                                   (y >> step) - kept.lo[1])[(z >> step) - kept.lo[2]];
          }
  }
  const std::vector<float> expected = values_of(expected_block(chain, in, c.box()));
  std::vector<ConvSource> sources;
  for (std::size_t i = 0; i < stores.size(); ++i)
    sources.push_back({stores[i].window.planes(), c.sources[i].upsampled});
  const std::size_t scratch_size = kernels::winograd_scratch(chain);
  testing::on_every_target([&] {
    const TileRange range = tile_range(c.box(), c.origin);
    const Store out(whole_tiles_across(c.box(), c.origin), chain.outputs(), 4);
    const auto scratch = hwy::AllocateAligned<float>(scratch_size);
    kernels::winograd_conv3d(chain, sources, range, out.window.planes(), scratch.get());
    CHECK(values_of(out.window, c.box()) == expected);
  });
}

}  // namespace

TEST_CASE("a chain of convolutions is its reference bit for bit", "[kernels]") {
  const std::vector<ConvCase> cases = {
      {{{1, false}}, {1}, {0, 0, 0}, {1, 1, 1}},
      {{{3, false}}, {4}, {-1, 5, -3}, {3, 2, 7}},
      {{{24, false}}, {24, 24, 3}, {100001, -4, -5}, {2, 3, 21}},
      {{{4, false}, {5, false}}, {8}, {2, 2, 2}, {4, 6, 9}, 2, /*wider=*/5}};
  for (const ConvCase& c : cases) check(c);
}

TEST_CASE("a chain in tiles at odd coordinates is its reference bit for bit", "[kernels]") {
  const std::vector<ConvCase> cases = {
      {{{1, false}}, {1}, {0, 0, 0}, {1, 1, 1}},
      {{{3, false}}, {4}, {-1, 5, -3}, {3, 2, 7}},
      {{{2, true}}, {5}, {1, -1, 3}, {2, 5, 4}},
      {{{2, true}}, {5}, {-1, -1, -1}, {18, 18, 18}},
      {{{5, true}, {4, false}}, {7, 3}, {-6, 3, 8}, {3, 4, 37}},
      {{{4, false}, {3, true}, {2, false}}, {6, 9, 2}, {7, -2, -31}, {1, 7, 70}},
      {{{20, true}, {4, false}}, {24, 24, 3}, {100001, -4, -5}, {2, 3, 21}},
      {{{5, true}, {4, false}}, {8}, {2, 2, 2}, {4, 6, 9}, 2, /*wider=*/5}};
  for (ConvCase c : cases) {
    c.origin = 1;
    check(c);
  }
}

TEST_CASE("a chain in tiles of four is its reference bit for bit", "[kernels]") {
  const std::vector<ConvCase> cases = {
      {{{1, false}}, {1}, {0, 0, 0}, {4, 1, 1}, 4},
      {{{3, false}}, {4}, {-4, 5, -3}, {8, 2, 7}, 4},
      {{{4, false}, {2, false}}, {6, 9, 2}, {-8, -2, -31}, {4, 7, 70}, 4},
      {{{24, false}}, {24, 24, 3}, {100004, -4, -5}, {4, 3, 21}, 4},
      {{{2, false}, {3, false}}, {8}, {4, 2, 2}, {12, 6, 9}, 4, 5}};
  for (const ConvCase& c : cases) check(c);
}

TEST_CASE("a chain that begins tap by tap is its reference bit for bit", "[kernels]") {
  const std::vector<ConvCase> cases = {{{{1, false}}, {1}, {0, 0, 0}, {1, 1, 1}, 1},
                                       {{{3, false}}, {4}, {-1, 5, -3}, {3, 2, 7}, 1},
                                       {{{4, false}}, {4, 4}, {-7, -2, -31}, {2, 7, 70}, 1},
                                       {{{2, false}}, {9, 3}, {3, 3, 8}, {5, 4, 37}, 1, 5}};
  for (ConvCase c : cases)
    for (c.origin = 0; c.origin < 2; ++c.origin) check(c);
}

TEST_CASE("a Winograd convolution is a convolution", "[kernels]") {
  const Box box{{-4, 2, 5}, {4, 6, 12}};
  const int inputs = 6, outputs = 5;
  const Block in = random_block(grown(box, 1), inputs);
  const auto weights = random_values(inputs * outputs * 27, 1);
  const auto bias = random_values(outputs, 1);
  Block found(box, outputs), expected(box, outputs);
  const LinearLayer direct(outputs, inputs * 27, bias,
                           [&](int o, int t) { return weights[o * inputs * 27 + t]; });
  reference::conv3d(direct, 3, in.volume(), expected.volume());
  const auto tile = GENERATE(2, 4);
  const std::vector<bool> upsampled(inputs, false);
  reference::winograd_conv3d(WinogradLayer(tile, upsampled, outputs, weights, bias), 0, box.lo,
                             in.volume(), found.volume());
  const auto a = values_of(found), b = values_of(expected);
  float error = 0;
  for (std::size_t i = 0; i < a.size(); ++i) error = std::max(error, std::fabs(a[i] - b[i]));
  CHECK(error < 1e-4f);  // of sums of 162 products of up to 2
  CHECK(error > 0);
}
