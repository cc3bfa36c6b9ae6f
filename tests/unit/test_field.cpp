#include <algorithm>
#include <random>
#include <set>

#include "catch.hpp"
#include "engine/field/field.h"
#include "tests/unit/example_models.h"

using namespace solidtex::engine;

namespace {

constexpr std::uint64_t kSeed = 7;

std::vector<float> evaluate(const Field& field, const Box& box) {
  std::vector<float> values(box.volume() * static_cast<std::size_t>(field.channels()), -1.0f);
  field.evaluate(box, values.data());
  return values;
}

Box box_at(std::array<std::int64_t, 3> lo, std::array<std::int64_t, 3> size) {
  return {lo, {lo[0] + size[0], lo[1] + size[1], lo[2] + size[2]}};
}

// The values of `part` taken out of those of `whole`.
std::vector<float> crop(const std::vector<float>& values, const Box& whole, const Box& part,
                        int channels) {
  std::vector<float> result;
  for (auto x = part.lo[0]; x < part.hi[0]; ++x)
    for (auto y = part.lo[1]; y < part.hi[1]; ++y) {
      const auto row = ((x - whole.lo[0]) * whole.size(1) + y - whole.lo[1]) * whole.size(2);
      const auto first = values.begin() + (row + part.lo[2] - whole.lo[2]) * channels;
      result.insert(result.end(), first, first + part.size(2) * channels);
    }
  return result;
}

void check_partitions(const FieldModel& model, std::array<std::int64_t, 3> lo) {
  const Field field(model, NoiseScheme::solidtex_1, kSeed);
  const Box whole = box_at(lo, {9, 7, 11});
  const std::vector<float> values = evaluate(field, whole);
  REQUIRE(std::set<float>(values.begin(), values.end()).size() > values.size() / 2);
  for (const auto& [offset, size] :
       std::vector<std::pair<std::array<std::int64_t, 3>, std::array<std::int64_t, 3>>>{
           {{0, 0, 0}, {1, 1, 1}},
           {{3, 2, 5}, {1, 1, 1}},
           {{8, 6, 10}, {1, 1, 1}},
           {{0, 0, 0}, {9, 7, 1}},
           {{4, 0, 0}, {5, 7, 11}},
           {{1, 2, 3}, {5, 3, 7}}}) {
    const Box part = box_at({lo[0] + offset[0], lo[1] + offset[1], lo[2] + offset[2]}, size);
    CAPTURE(lo, offset, size);
    CHECK(evaluate(field, part) == crop(values, whole, part, field.channels()));
  }
}

}  // namespace

TEST_CASE("any partition into boxes gives the same bits", "[field]") {
  constexpr std::int64_t far = std::int64_t{1} << 30;
  for (const std::array<std::int64_t, 3> lo :
       {std::array<std::int64_t, 3>{0, 0, 0}, {-5, -3, -6}, {far - 4, -far, 17}, {-far, far, -1}}) {
    check_partitions(example::gutierrez(), lo);
    check_partitions(example::every_operation(), lo);
  }
}

TEST_CASE("an empty box writes nothing", "[field]") {
  const Field field(example::every_operation(), NoiseScheme::solidtex_1, kSeed);
  float untouched = 5;
  field.evaluate(box_at({0, 0, 0}, {3, 0, 3}), &untouched);
  CHECK(untouched == 5);
}

TEST_CASE("seeds give different fields", "[field]") {
  const Box box = box_at({0, 0, 0}, {4, 4, 4});
  CHECK(evaluate(Field(example::every_operation(), NoiseScheme::solidtex_1, 1), box) !=
        evaluate(Field(example::every_operation(), NoiseScheme::solidtex_1, 2), box));
}

TEST_CASE("a scheme without normal noise refuses a model that asks for it", "[field]") {
  CHECK_THROWS(Field(example::every_operation(), NoiseScheme::solidtexturenets, 0));
}

namespace {

// Side lengths of the noise boxes that one voxel needs on one axis, index = level.
std::array<std::int64_t, 6> noise_sides(const FieldModel& model, std::int64_t position) {
  const std::vector<Box> regions =
      required_regions(model, box_at({position, position, position}, {1, 1, 1}));
  std::array<std::int64_t, 6> sides{};
  for (std::size_t i = 0; i < regions.size(); ++i)
    if (std::holds_alternative<NoiseOp>(model.nodes[i].op))
      sides[static_cast<std::size_t>(model.nodes[i].level)] = regions[i].size(0);
  return sides;
}

}  // namespace

TEST_CASE("one voxel never needs more noise than Gutierrez et al. bound", "[field]") {
  // Section 3.2 of the paper: 9^3 at z_0, 11^3 at z_1, 13^3 at z_2 to z_4, 9^3 at z_5.
  constexpr std::array<std::int64_t, 6> bound{9, 11, 13, 13, 13, 9};
  const FieldModel model = example::gutierrez();
  std::array<std::int64_t, 6> largest{};
  std::vector<std::array<std::int64_t, 6>> sides;
  for (std::int64_t position = -16; position < 16; ++position) {
    sides.push_back(noise_sides(model, position));
    for (std::size_t level = 0; level < 6; ++level) {
      CHECK(sides.back()[level] <= bound[level]);
      largest[level] = std::max(largest[level], sides.back()[level]);
    }
  }
  CHECK(largest == std::array<std::int64_t, 6>{9, 10, 12, 12, 12, 8});

  // The boxes of all 32^3 positions: their noise values in one channel, and how many are smaller.
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
  CHECK(most <= 9380);
  CHECK(smaller > 32 * 32 * 32 / 2);
  WARN("noise values for one voxel: at most " << most << ", smaller than 9380 in " << smaller
                                              << " of 32768 positions");
}
