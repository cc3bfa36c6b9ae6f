#include <algorithm>
#include <random>
#include <set>

#include "catch.hpp"
#include "engine/lattice/lattice.h"
#include "tests/unit/every_target.h"
#include "tests/unit/example_models.h"

using namespace solidtex::engine;

namespace {

constexpr std::uint64_t kSeed = 7;

std::vector<float> evaluate(const Lattice& field, const Box& box) {
  std::vector<float> values(box.volume() * static_cast<std::size_t>(field.channels()), -1.0f);
  field.evaluate(box, values.data());
  return values;
}

Box box_at(std::array<std::int64_t, 3> lo, std::array<std::int64_t, 3> size) {
  return {lo, {lo[0] + size[0], lo[1] + size[1], lo[2] + size[2]}};
}

// Returns the values of `part` from those of `whole`.
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

void check_partitions(const LatticeModel& model, std::array<std::int64_t, 3> lo) {
  const Lattice field(model, NoiseScheme::solidtex_1, kSeed);
  const Box whole = box_at(lo, {9, 7, 11});
  const std::vector<float> values = evaluate(field, whole);
  REQUIRE(std::set<float>(values.begin(), values.end()).size() > values.size() / 2);
  testing::on_every_target([&] { CHECK(evaluate(field, whole) == values); });
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

TEST_CASE("any partition into boxes and any target give the same bits", "[lattice]") {
  constexpr std::int64_t far = std::int64_t{1} << 30;
  for (const std::array<std::int64_t, 3> lo :
       {std::array<std::int64_t, 3>{0, 0, 0}, {-5, -3, -6}, {far - 4, -far, 17}, {-far, far, -1}}) {
    check_partitions(example::gutierrez(), lo);
    check_partitions(example::every_operation(), lo);
  }
}

namespace {

// Transposed convolutions of kernel 1 reach every other voxel, four of them every sixteenth: whole
// steps need no coarse nodes.
LatticeModel sparse_reader() {
  example::LatticeBuilder b(5);
  int sparse = b.conv(b.noise(4, 2), 3, 3);
  for (int level = 3; level >= 0; --level) sparse = b.conv_transpose(sparse, 2, 1, 0);
  b.conv(b.concat(sparse, b.upsample(b.noise(1, 1))), 2, 1);
  return b.model;
}

// Compares single voxels along the diagonal of y and z.
void check_voxels(const LatticeModel& model, const Box& whole) {
  const Lattice field(model, NoiseScheme::solidtex_1, kSeed);
  const std::vector<float> values = evaluate(field, whole);
  for (std::int64_t x = whole.lo[0]; x < whole.hi[0]; ++x)
    for (std::int64_t i = 0; i < std::min(whole.size(1), whole.size(2)); ++i) {
      const Box part = box_at({x, whole.lo[1] + i, whole.lo[2] + i}, {1, 1, 1});
      CAPTURE(x, i);
      CHECK(evaluate(field, part) == crop(values, whole, part, field.channels()));
    }
}

}  // namespace

TEST_CASE("a box of many steps along x has the bits of its voxels", "[lattice]") {
  for (const std::int64_t lo : {-29, 3}) {  // across zero, and not
    check_voxels(example::every_operation(), box_at({lo, -3, 5}, {53, 2, 3}));
    check_voxels(example::gutierrez(2), box_at({lo, -3, 5}, {53, 2, 3}));
  }
  for (const std::int64_t lo : {6, 7, -17})  // the last step begins at 8 modulo 16, and not
    for (const std::int64_t size : {9, 10, 18, 21})
      check_voxels(sparse_reader(), box_at({lo, -1, -1}, {size, 3, 3}));
}

TEST_CASE("an empty box writes nothing", "[lattice]") {
  const Lattice field(example::every_operation(), NoiseScheme::solidtex_1, kSeed);
  float untouched = 5;
  field.evaluate(box_at({0, 0, 0}, {3, 0, 3}), &untouched);
  CHECK(untouched == 5);
}

TEST_CASE("seeds give different textures", "[lattice]") {
  const Box box = box_at({0, 0, 0}, {4, 4, 4});
  CHECK(evaluate(Lattice(example::every_operation(), NoiseScheme::solidtex_1, 1), box) !=
        evaluate(Lattice(example::every_operation(), NoiseScheme::solidtex_1, 2), box));
}

TEST_CASE("a scheme without normal noise refuses a model that needs it", "[lattice]") {
  CHECK_THROWS(Lattice(example::every_operation(), NoiseScheme::solidtexturenets, 0));
}

TEST_CASE("with a period a solid repeats bit by bit on every axis", "[lattice]") {
  for (const auto& model : {example::every_operation(), example::gutierrez(3)})
    for (const std::int64_t period : {8, 24, 40}) {
      const Lattice field(model, NoiseScheme::solidtex_1, kSeed,
                          static_cast<std::uint64_t>(period));
      const Box whole = box_at({-5, 2, -period}, {13 + period, 7, 9 + period});
      const std::vector<float> values = evaluate(field, whole);
      const Box part = box_at({-3, 4, 1 - period}, {6, 4, 7});
      const std::vector<float> expected = crop(values, whole, part, field.channels());
      CHECK(evaluate(field, box_at({-3 + period, 4, 1 - period}, {6, 4, 7})) == expected);
      CHECK(evaluate(field, box_at({-3, 4 - 5 * period, 1 + period}, {6, 4, 7})) == expected);
      CHECK(crop(values, whole, box_at({-3 + period, 4, 1}, {6, 4, 7}), field.channels()) ==
            expected);
    }
}

TEST_CASE("a period changes no voxel that is far from its faces", "[lattice]") {
  const Box box = box_at({250, 251, 252}, {9, 8, 7});
  const Lattice endless(example::gutierrez(3), NoiseScheme::solidtex_1, kSeed);
  const Lattice periodic(example::gutierrez(3), NoiseScheme::solidtex_1, kSeed, 512);
  CHECK(evaluate(periodic, box) == evaluate(endless, box));
  const Box outside = box_at({250 + 512, 251, 252}, {9, 8, 7});
  CHECK(evaluate(periodic, outside) != evaluate(endless, outside));
}

TEST_CASE("a period of no whole number of coarse voxels is refused", "[lattice]") {
  for (const std::uint64_t period : {4ull, 12ull, 1ull << 31})
    CHECK_THROWS_WITH(
        Lattice(example::gutierrez(3), NoiseScheme::solidtex_1, kSeed, period),
        "parameter \"period\" is " + std::to_string(period) +
            ", expected a multiple of 8 texels up to 2^30 for this model, or 0 for none");
}
