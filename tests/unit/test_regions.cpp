#include <algorithm>
#include <set>

#include "catch.hpp"
#include "engine/lattice/regions.h"
#include "tests/unit/example_models.h"

using namespace solidtex::engine;

namespace {

using Indices = std::set<std::int64_t>;

// The inputs that one output index reads on one axis, by the definitions of docs/file-format.md.
struct Reads {
  std::int64_t i;

  Indices operator()(const Conv3dOp& op) const {
    Indices result;
    for (int t = 0; t < op.kernel; ++t) result.insert(i + t - op.kernel / 2);
    return result;
  }
  Indices operator()(const ConvTranspose3dOp& op) const {
    Indices result;
    for (std::int64_t j = i / 2 - 20; j <= i / 2 + 20; ++j)
      for (int t = 0; t < op.kernel; ++t)
        if (i == 2 * j + t - op.padding) result.insert(j);
    return result;
  }
  Indices operator()(const UpsampleOp&) const { return {i >= 0 ? i / 2 : -((1 - i) / 2)}; }
  template <class ElementWise>
  Indices operator()(const ElementWise&) const {
    return {i};
  }
};

// Returns every index of every node on which an output range depends.
std::vector<Indices> dependencies(const LatticeModel& model, std::int64_t lo, std::int64_t hi) {
  std::vector<Indices> result(model.nodes.size());
  for (auto i = lo; i < hi; ++i) result.back().insert(i);
  for (std::size_t n = result.size(); n-- > 0;)
    for (const auto i : result[n])
      for (const int input : model.nodes[n].inputs)
        result[static_cast<std::size_t>(input)].merge(std::visit(Reads{i}, model.nodes[n].op));
  return result;
}

void check_exact(const LatticeModel& model, std::int64_t lo, std::int64_t hi) {
  const std::vector<Indices> needed = dependencies(model, lo, hi);
  const std::vector<Box> regions = required_regions(model, {{lo, lo, lo}, {hi, hi, hi}});
  for (std::size_t n = 0; n < regions.size(); ++n) {
    CAPTURE(model.nodes[n].name, lo, hi);
    REQUIRE(!needed[n].empty());
    CHECK(regions[n].lo[1] == *needed[n].begin());
    CHECK(regions[n].hi[1] == *needed[n].rbegin() + 1);
  }
}

Box box_at(std::array<std::int64_t, 3> lo, std::array<std::int64_t, 3> size) {
  return {lo, {lo[0] + size[0], lo[1] + size[1], lo[2] + size[2]}};
}

}  // namespace

TEST_CASE("regions are exactly what the definition of each operation reads", "[regions]") {
  for (std::int64_t lo = -9; lo < 9; ++lo)
    for (const std::int64_t size : {1, 2, 5, 16}) {
      check_exact(example::gutierrez(), lo, lo + size);
      check_exact(example::every_operation(), lo, lo + size);
    }
  constexpr std::int64_t far = std::int64_t{1} << 30;
  check_exact(example::every_operation(), far - 1, far + 2);
  check_exact(example::every_operation(), -far - 1, -far + 2);
}

TEST_CASE("an output that no tap reaches needs nothing", "[regions]") {
  example::LatticeBuilder b(1);
  b.conv_transpose(b.noise(1, 1), 1, /*kernel=*/1, /*padding=*/0);
  CHECK(required_regions(b.model, box_at({1, 0, 0}, {1, 1, 1}))[0].empty());
  CHECK(required_regions(b.model, box_at({0, 0, 0}, {1, 1, 1}))[0] == box_at({0, 0, 0}, {1, 1, 1}));
}

namespace {

// Returns the sides of the noise boxes that one voxel needs, by level.
std::array<std::int64_t, 6> noise_sides(const LatticeModel& model, std::int64_t position) {
  const std::vector<Box> regions =
      required_regions(model, box_at({position, position, position}, {1, 1, 1}));
  std::array<std::int64_t, 6> sides{};
  for (std::size_t i = 0; i < regions.size(); ++i)
    if (std::holds_alternative<NoiseOp>(model.nodes[i].op))
      sides[static_cast<std::size_t>(model.nodes[i].level)] = regions[i].size(0);
  return sides;
}

}  // namespace

TEST_CASE("one voxel never needs more noise than Gutierrez et al. bound", "[regions]") {
  // Section 3.2 of the paper: 9^3 at z_0, 11^3 at z_1, 13^3 at z_2 to z_4, 9^3 at z_5.
  constexpr std::array<std::int64_t, 6> bound{9, 11, 13, 13, 13, 9};
  const LatticeModel model = example::gutierrez();
  std::array<std::int64_t, 6> largest{};
  std::vector<std::array<std::int64_t, 6>> sides;
  for (std::int64_t position = -16; position < 16; ++position) {
    sides.push_back(noise_sides(model, position));
    for (std::size_t level = 0; level < 6; ++level) {
      CHECK(sides.back()[level] <= bound[level]);
      largest[level] = std::max(largest[level], sides.back()[level]);
    }
  }
  CHECK(largest == std::array<std::int64_t, 6>{9, 11, 12, 13, 13, 9});

  // Boxes of all 32^3 positions: noise values in one channel, and how many boxes are smaller.
  int smaller = 0;
  std::int64_t most = 0;
  for (const auto& x : sides)
    for (const auto& y : sides)
      for (const auto& z : sides) {
        std::int64_t count = 0;
        for (std::size_t level = 0; level < 6; ++level) count += x[level] * y[level] * z[level];
        most = std::max(most, count);
        smaller += count < 9380;
      }
  CHECK(most == 8911);
  CHECK(smaller == 32 * 32 * 32);
}
