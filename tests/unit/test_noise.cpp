#include <array>
#include <cmath>
#include <cstring>
#include <random>
#include <set>
#include <vector>

#include "catch.hpp"
#include "engine/noise/noise.h"
#include "engine/noise/normal.h"
#include "engine/noise/solidtex_1.h"
#include "engine/noise/waves.h"
#include "tests/unit/every_target.h"

using namespace solidtex::engine;

namespace {

std::int32_t random_coordinate(std::mt19937& random) {
  constexpr std::int32_t edges[] = {0, -1, 1 << 30, -(1 << 30), INT32_MAX, INT32_MIN};
  const std::uint32_t bits = random();
  return bits % 4 == 0 ? edges[bits / 4 % 6] : static_cast<std::int32_t>(random());
}

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

std::int32_t next(std::int32_t i) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(i) + 1);
}

}  // namespace

TEST_CASE("solidtex-1 gives the numbers of docs/noise.md", "[noise]") {
  // Computed in Python integers by tests/battery/noise_vectors.py.
  const StreamKey key = make_stream_key(1, 2, 3);
  CHECK(key.word[0] == 0x5E29B091u);
  CHECK(key.word[3] == 0x3C6585C2u);
  CHECK(solidtex_1_bits(key, 4, 5, 6) == 0x14DFAC15u);
  CHECK(solidtex_1_bits(make_stream_key(0, 0, 0), 0xFFFFFFFFu, 0x80000000u, 7) == 0x1D2E1971u);
  CHECK(solidtexturenets_bits(0, 6, 4, 70000, 0xFFFFFFFFu, 3) == 0x70A6D133BC71BAE7u);
  CHECK(solidtexturenets_bits(0, 0, 0, 0, 0, 0) == 0x107AE22413063053u);
  CHECK(solidtexturenets_bits(9, 1, 2, 3, 4, 5) == 0x9F5B9914E0CE6F1Du);
}

TEST_CASE("uniform noise is in range, and its ends are exact", "[noise]") {
  CHECK(uniform_from_bits(0) == 0.0f);
  CHECK(uniform_from_bits(0xFFu) == 0.0f);
  CHECK(uniform_from_bits(0x100u) == 0x1p-24f);
  CHECK(uniform_from_bits(0xFFFFFFFFu) == 1.0f - 0x1p-24f);
}

TEST_CASE("normal noise is symmetric and monotonic", "[noise]") {
  float previous = normal_from_bits(0x80000000u);
  CHECK(previous == Approx(6.33795));
  std::uint32_t decreases = 0;
  for (std::uint32_t low = 0; low < 0x80000000u - 40499u; low += 40499u) {
    const float value = normal_from_bits(0x80000000u | low);
    CHECK(normal_from_bits(low) == -value);
    // Neighbors may be equal or differ by rounding. Over 40499 steps the order is clear.
    decreases += value > previous;
    previous = value;
  }
  CHECK(decreases == 0);
  CHECK(std::fabs(normal_from_bits(0xFFFFFFFFu)) < 1e-6f);
}

TEST_CASE("planes are single values, on every target", "[noise]") {
  std::mt19937 random(3);
  for (int round = 0; round < 40; ++round) {
    const std::uint64_t seed = random() % 3 * 0x123456789ABCDEFu;
    const NoiseStream noise(NoiseScheme::solidtex_1, seed, random() % 21, random() % 8);
    const auto x = random_coordinate(random);
    const int count = 1 + static_cast<int>(random() % 200);
    std::vector<std::int32_t> y, z;
    std::vector<float> uniform, normal;
    for (int i = 0; i < count; ++i) {
      y.push_back(random_coordinate(random));
      z.push_back(random_coordinate(random));
      uniform.push_back(noise.uniform(x, y.back(), z.back()));
      normal.push_back(noise.normal(x, y.back(), z.back()));
    }
    y.resize(y.size() + 16);  // readable to whole vectors
    z.resize(z.size() + 16);
    const LatticePoints points{static_cast<std::uint32_t>(x), y.data(), z.data()};
    testing::on_every_target([&] {
      std::vector<float> plane(static_cast<std::size_t>(count));
      noise.plane(Distribution::uniform, points, count, plane.data());
      CHECK(same_bits(plane, uniform));
      noise.plane(Distribution::normal, points, count, plane.data());
      CHECK(same_bits(plane, normal));
    });
  }
}

TEST_CASE("waves are their reference bit for bit, on every target", "[noise]") {
  std::mt19937 random(8);
  for (const int count : {1, 7, 16, 37, 64}) {
    const auto padded = static_cast<std::size_t>(count + 15) / 16 * 16;
    std::vector<std::int32_t> y, z;
    for (std::size_t i = 0; i < padded; ++i) {
      y.push_back(random_coordinate(random));
      z.push_back(random_coordinate(random));
    }
    const Wave wave{{static_cast<std::uint32_t>(random()), static_cast<std::uint32_t>(random()),
                     static_cast<std::uint32_t>(random())},
                    static_cast<std::uint32_t>(random())};
    const LatticePoints points{static_cast<std::uint32_t>(random()), y.data(), z.data()};
    const auto size = static_cast<std::size_t>(count);
    std::vector<float> expected(size + 1, 5.0f), found(size + 1, 5.0f);
    reference::waves(wave, points, count, expected.data());
    testing::on_every_target([&] {
      waves(wave, points, count, found.data());
      CHECK(same_bits(found, expected));
    });
    CHECK(found[size] == 5.0f);
  }
}

TEST_CASE("a wave is the same at any distance from the origin", "[noise]") {
  // A period of 4096 voxels is exact in 2^-32 turns.
  const Wave wave{{3u << 20, 5u << 20, 7u << 20}, 11};
  std::vector<std::int32_t> near(16), far(16);
  for (std::int32_t i = 0; i < 16; ++i) near[i] = i, far[i] = i + 4096 * 131071;
  float expected[16], found[16];
  waves(wave, {1, near.data(), near.data()}, 16, expected);
  waves(wave, {1 + 4096u * 1048575u, far.data(), far.data()}, 16, found);
  CHECK(std::memcmp(found, expected, sizeof found) == 0);
  CHECK(std::set<float>(expected, expected + 16).size() == 16);
}

TEST_CASE("with a period a wave has whole turns, the nearest ones", "[noise]") {
  for (const std::uint32_t period : {1u, 24u, 1000u, 1u << 30}) {
    const auto rounded = with_period({{0x12345678u, 0xFFFFFF00u, 0x80000001u}, 3}, period);
    CHECK(rounded.phase == 3);
    for (int axis = 0; axis < 3; ++axis) {
      const std::uint32_t before[] = {0x12345678u, 0xFFFFFF00u, 0x80000001u};
      const double turns = rounded.frequency[axis] * 0x1p-32 * period;
      CHECK(std::fabs(turns - std::round(turns)) <= period * 0x1p-32);
      const auto change = static_cast<std::int32_t>(rounded.frequency[axis] - before[axis]);
      CHECK(std::fabs(change * 0x1p-32) * period <= 0.5 + period * 0x1p-32);
    }
  }
}

TEST_CASE("trilinear lookups are lerps of single values, on every target", "[noise]") {
  constexpr int kPoints = 96;
  std::mt19937 random(4);
  std::uniform_real_distribution<float> unit(0, 1);
  std::int32_t corner[3][kPoints];
  float fraction[3][kPoints];
  for (int axis = 0; axis < 3; ++axis)
    for (int p = 0; p < kPoints; ++p) {
      corner[axis][p] = random_coordinate(random);
      fraction[axis][p] = p < 2 ? static_cast<float>(p) : unit(random);
    }
  const LatticeCells cells{{corner[0], corner[1], corner[2]},
                           {fraction[0], fraction[1], fraction[2]}};
  const NoiseStream noise(NoiseScheme::solidtex_1, 5, 6, 0);
  const StreamKey key = make_stream_key(5, 6, 0);
  const auto lerp = [](float t, float a, float b) { return std::fma(t, b - a, a); };
  std::vector<float> expected;
  for (int p = 0; p < kPoints; ++p) {
    const auto x = corner[0][p], y = corner[1][p], z = corner[2][p];
    const auto along_z = [&](std::int32_t i, std::int32_t j) {
      return lerp(fraction[2][p], noise.normal(i, j, z), noise.normal(i, j, next(z)));
    };
    const auto along_y = [&](std::int32_t i) {
      return lerp(fraction[1][p], along_z(i, y), along_z(i, next(y)));
    };
    expected.push_back(lerp(fraction[0][p], along_y(x), along_y(next(x))));
  }
  CHECK(expected[0] == noise.normal(corner[0][0], corner[1][0], corner[2][0]));
  for (const std::size_t count : {1, 15, 16, 17, 96})
    testing::on_every_target([&] {
      std::vector<float> values(count);
      solidtex_1::trilinear_normal(key, cells, static_cast<int>(count), values.data());
      CHECK(same_bits(values, {expected.begin(), expected.begin() + static_cast<long>(count)}));
    });
}

TEST_CASE("lookups close together are those one by one, on every target", "[noise]") {
  constexpr int kPoints = 96;
  std::mt19937 random(8);
  const StreamKey key = make_stream_key(5, 6, 0);
  for (const std::int32_t start : {0, -3, INT32_MAX - 2, INT32_MIN})
    for (const std::uint32_t range : {1, 2, 3, 4, 5}) {
      std::int32_t corner[3][kPoints];
      float fraction[3][kPoints];
      for (int axis = 0; axis < 3; ++axis)
        for (int p = 0; p < kPoints; ++p) {
          corner[axis][p] = static_cast<std::int32_t>(static_cast<std::uint32_t>(start) +
                                                      random() % (range + axis));
          fraction[axis][p] = static_cast<float>(random() % 1024) / 1024;
        }
      const LatticeCells cells{{corner[0], corner[1], corner[2]},
                               {fraction[0], fraction[1], fraction[2]}};
      for (const std::size_t count : {15, 16, 17, 48, 95, 96}) {
        std::vector<float> expected(count);
        reference::trilinear_normal(key, cells, static_cast<int>(count), expected.data());
        testing::on_every_target([&] {
          std::vector<float> values(count);
          solidtex_1::trilinear_normal(key, cells, static_cast<int>(count), values.data());
          CHECK(same_bits(values, expected));
        });
      }
    }
}

TEST_CASE("derivatives of lookups are those of the reference, on every target", "[noise]") {
  constexpr int kPoints = 96;
  constexpr float kTransform[9] = {0.5f, -0.25f, 0.1f, 0, 2, 0.3f, -1, 0.7f, 0.01f};
  std::mt19937 random(9);
  const StreamKey key = make_stream_key(5, 6, 0);
  for (const std::uint32_t range : {3, 1000}) {  // close together, and not
    std::int32_t corner[3][kPoints];
    float fraction[3][kPoints];
    for (int axis = 0; axis < 3; ++axis)
      for (int p = 0; p < kPoints; ++p) {
        corner[axis][p] = static_cast<std::int32_t>(random() % range);
        fraction[axis][p] = static_cast<float>(random() % 1025) / 1024;
      }
    const LatticeCells cells{{corner[0], corner[1], corner[2]},
                             {fraction[0], fraction[1], fraction[2]}};
    for (const std::size_t count : {1, 15, 16, 17, 48, 96}) {
      std::vector<float> plain(count);
      std::vector<std::vector<float>> expected(4, plain), found = expected;
      const auto derivatives_of = [](std::vector<std::vector<float>>& rows) {
        return std::array<float*, 3>{rows[1].data(), rows[2].data(), rows[3].data()};
      };
      const auto number = static_cast<int>(count);
      reference::trilinear_normal(key, cells, number, plain.data());
      reference::trilinear_normal_derivatives(key, cells, kTransform, number, expected[0].data(),
                                              derivatives_of(expected).data());
      CHECK(same_bits(expected[0], plain));
      testing::on_every_target([&] {
        solidtex_1::trilinear_normal_derivatives(key, cells, kTransform, number, found[0].data(),
                                                 derivatives_of(found).data());
        for (std::size_t row = 0; row < 4; ++row) CHECK(same_bits(found[row], expected[row]));
      });
    }
  }
}

TEST_CASE("lookups in many streams are those in each, on every target", "[noise]") {
  constexpr int kStreams = 48;
  std::mt19937 random(6);
  std::int32_t corner[3][kStreams];
  float fraction[3][kStreams];
  std::uint32_t word[4][kStreams];
  std::vector<float> expected(kStreams);
  for (int i = 0; i < kStreams; ++i) {
    const StreamKey key = make_stream_key(9, static_cast<std::uint32_t>(i), 0);
    for (int k = 0; k < 4; ++k) word[k][i] = key.word[k];
    for (int axis = 0; axis < 3; ++axis) {
      corner[axis][i] = random_coordinate(random);
      fraction[axis][i] = static_cast<float>(random() % 1024) / 1024;
    }
    const LatticeCells one{{&corner[0][i], &corner[1][i], &corner[2][i]},
                           {&fraction[0][i], &fraction[1][i], &fraction[2][i]}};
    reference::trilinear_normal(key, one, 1, &expected[i]);
  }
  const LatticeCells cells{{corner[0], corner[1], corner[2]},
                           {fraction[0], fraction[1], fraction[2]}};
  for (const std::size_t count : {1, 16, 31, 48})
    testing::on_every_target([&] {
      std::vector<float> values(count);
      solidtex_1::trilinear_normal_of_streams({{word[0], word[1], word[2], word[3]}}, cells,
                                              static_cast<int>(count), values.data());
      CHECK(same_bits(values, {expected.begin(), expected.begin() + static_cast<long>(count)}));
    });
}

TEST_CASE("solidtexturenets is uniform only and repeats as published", "[noise]") {
  const auto stream = [](std::uint32_t level, std::uint32_t channel) {
    return NoiseStream(NoiseScheme::solidtexturenets, 0, level, channel);
  };
  CHECK_THROWS(stream(0, 0).normal(1, 2, 3));
  constexpr std::int32_t y[16] = {-8, -8, 7}, z[16] = {65534, 65535, 65536};
  const LatticePoints points{7, y, z};
  float values[3];
  CHECK_THROWS(stream(0, 0).plane(Distribution::normal, points, 3, values));
  CHECK(stream(0, 0).uniform(1, 2, 3) == stream(0, 0).uniform(1 + 65536, 2 - 65536, 3));
  CHECK(stream(0, 0).uniform(1, 2, 3) == stream(5, 3).uniform(1, 2, 3));  // its known flaws
  CHECK(stream(0, 1).uniform(1, 2, 3) == stream(0, 0).uniform(1, 2, 6));
  CHECK(NoiseStream(NoiseScheme::solidtexturenets, 1, 0, 0).uniform(1, 2, 3) !=
        stream(0, 0).uniform(1, 2, 3));
  stream(2, 1).plane(Distribution::uniform, points, 3, values);
  for (int i = 0; i < 3; ++i) CHECK(values[i] == stream(2, 1).uniform(7, y[i], z[i]));
}

TEST_CASE("every argument of solidtex-1 matters", "[noise]") {
  std::set<float> values;
  for (std::uint64_t seed : {0, 1}) {
    for (std::uint32_t level : {0, 1})
      for (std::uint32_t channel : {0, 1})
        for (std::int32_t x : {0, 1})
          for (std::int32_t y : {0, 1})
            for (std::int32_t z : {0, 1})
              values.insert(
                  NoiseStream(NoiseScheme::solidtex_1, seed, level, channel).normal(x, y, z));
  }
  CHECK(values.size() == 64);
}
