// Sample sequences: stratification, independence, integration error.
#include <cmath>
#include <functional>

#include "catch.hpp"
#include "plugins/pathtracer/sampling/angles.h"
#include "plugins/pathtracer/sampling/sample_sequence.h"
#include "plugins/pathtracer/sampling/sampling.h"
#include "tests/scenes/directions.h"

using namespace solidtex::pathtracer;

namespace {

// Sobol's second dimension by direction numbers, v(k + 1) = v(k) xor v(k) / 2.
std::uint32_t second_dimension(std::uint32_t index) {
  std::uint32_t result = 0;
  for (std::uint32_t v = 1u << 31; index != 0; index >>= 1, v ^= v >> 1) {
    if (index & 1) result ^= v;
  }
  return result;
}

using Point = std::function<glm::vec2(std::uint64_t key, std::uint32_t i)>;

// Root mean square error, over many seeds, of integrals by kCount points.
constexpr std::uint32_t kCount = 256;
double error_of(const Point& point, double (*f)(const glm::vec2&), double exact) {
  constexpr int kKeys = 200;
  double sum = 0;
  for (std::uint64_t key = 0; key < kKeys; ++key) {
    double mean = 0;
    for (std::uint32_t i = 0; i < kCount; ++i) mean += f(point(key, i)) / kCount;
    sum += (mean - exact) * (mean - exact);
  }
  return std::sqrt(sum / kKeys);
}

glm::vec2 random_point(std::uint64_t key, std::uint32_t i) {
  scene_tests::Random random(solidtex::mix(solidtex::mix(key) + i));
  const float x = random.next();
  return {x, random.next()};
}

// A jittered grid.
glm::vec2 stratified_point(std::uint64_t key, std::uint32_t i) {
  const glm::vec2 cell(static_cast<float>(i % 16), static_cast<float>(i / 16));
  return (cell + random_point(key, i)) / 16.0f;
}

glm::vec2 sampler_point(std::uint64_t key, std::uint32_t i) {
  return SampleSequence(key, 5, i).get_2d(3);
}

}  // namespace

TEST_CASE("The second dimension is Sobol's") {
  for (std::uint32_t i = 0; i < 5000; ++i)
    REQUIRE(reverse_bits(reversed_sobol_1(i)) == second_dimension(i));
  for (const std::uint32_t i : {0x80000000u, 0xffffffffu, 0xdeadbeefu, 0x00010001u}) {
    CHECK(reverse_bits(reversed_sobol_1(i)) == second_dimension(i));
  }
}

TEST_CASE("SamplePairs gives the pairs of each sequence") {
  SamplePairs pairs;
  for (const int count : {1, 5, 16, 33, kBatchSize}) {
    const auto sequence = [](int i) {
      return SampleSequence(9, static_cast<std::uint32_t>(i / 3),
                            1000003u * static_cast<std::uint32_t>(i));
    };
    std::vector<SampleSequence> samplers;
    for (int i = 0; i < count; ++i) samplers.push_back(sequence(i));
    pairs.draw(count, 4, [&](int i) -> const SampleSequence& {
      return samplers[static_cast<std::size_t>(i)];
    });
    for (int i = 0; i < count; ++i) CHECK(pairs[i] == sequence(i).get_2d(4));
  }
}

TEST_CASE("Trigonometry in turns agrees with libm") {
  constexpr double kTurn = 2 * glm::pi<double>();
  double circle_error = 0, turns_error = 0;
  for (int i = -4000; i <= 8000; ++i) {
    const float turns = static_cast<float>(i) / 3999.0f;
    const glm::vec2 place = unit_circle(turns);
    circle_error = std::max({circle_error, std::abs(place.x - std::cos(kTurn * turns)),
                             std::abs(place.y - std::sin(kTurn * turns))});
    const glm::vec2 far = 1e3f * place;
    const double angle = std::atan2(static_cast<double>(far.y), static_cast<double>(far.x)) / kTurn;
    turns_error = std::max(turns_error, std::abs(turns_of(far.x, far.y) - angle));
  }
  CHECK(circle_error < 1.5e-7);
  CHECK(turns_error < 6e-8);
  CHECK(turns_of(0, 0) == 0);
  CHECK(turns_of(-1, 0) == 0.5f);
  CHECK(turns_of(0, -2) == -0.25f);
  CHECK(unit_circle(0.75f) == glm::vec2(0, -1));
}

TEST_CASE("64 samples are stratified over all elementary intervals of area 1 / 64") {
  for (std::uint32_t dimension = 0; dimension < 5; ++dimension) {
    for (const std::uint32_t start : {0u, 64u, 640u}) {
      for (std::uint32_t columns = 1; columns <= 64; columns *= 2) {
        const std::uint32_t rows = 64 / columns;
        std::vector<int> cells(64), line(64);
        for (std::uint32_t i = start; i < start + 64; ++i) {
          const SampleSequence sequence(3, 11, i);
          const glm::vec2 u = sequence.get_2d(dimension);
          const auto x = static_cast<std::size_t>(u.x * static_cast<float>(columns));
          const auto y = static_cast<std::size_t>(u.y * static_cast<float>(rows));
          ++cells[y * columns + x];
          ++line[static_cast<std::size_t>(sequence.get_1d(dimension) * 64)];
        }
        CHECK(cells == std::vector<int>(64, 1));
        CHECK(line == std::vector<int>(64, 1));
      }
    }
  }
}

TEST_CASE("Dimensions and pixels are independent of each other") {
  constexpr std::uint32_t kSamples = 4096;
  const auto correlation = [](auto a, auto b) {
    double sum = 0;
    for (std::uint32_t i = 0; i < kSamples; ++i) sum += (a(i) - 0.5) * (b(i) - 0.5) * 12 / kSamples;
    return sum;
  };
  for (std::uint32_t d = 0; d < 8; ++d) {
    const auto here = [&](std::uint32_t i) { return SampleSequence(1, 7, i).get_1d(d); };
    const auto next = [&](std::uint32_t i) { return SampleSequence(1, 7, i).get_1d(d + 1); };
    const auto beside = [&](std::uint32_t i) { return SampleSequence(1, 8, i).get_1d(d); };
    CAPTURE(d);
    CHECK(std::abs(correlation(here, next)) < 0.06);  // four standard deviations
    CHECK(std::abs(correlation(here, beside)) < 0.06);
  }
}

TEST_CASE("Integration error is below that of a jittered grid and of independent samples") {
  const auto smooth = [](const glm::vec2& u) {
    return double(u.x * u.x + u.y) * std::sin(3 * u.x * u.y);
  };
  const auto disc = [](const glm::vec2& u) { return glm::length(u) < 0.7f ? 1.0 : 0.0; };
  double exact = 0;
  constexpr int kFine = 2000;
  for (int i = 0; i < kFine; ++i) {
    for (int j = 0; j < kFine; ++j) exact += smooth((glm::vec2(i, j) + 0.5f) / float(kFine));
  }
  exact /= double(kFine) * kFine;
  const double chance = error_of(random_point, smooth, exact);
  const double grid = error_of(stratified_point, smooth, exact);
  const double sobol = error_of(sampler_point, smooth, exact);
  CAPTURE(chance, grid, sobol);
  CHECK(sobol < 0.3 * grid);
  CHECK(grid < 0.2 * chance);
  const double area = 0.49 * glm::pi<double>() / 4;
  const double disc_chance = error_of(random_point, disc, area);
  const double disc_grid = error_of(stratified_point, disc, area);
  const double disc_sobol = error_of(sampler_point, disc, area);
  CAPTURE(disc_chance, disc_grid, disc_sobol);
  CHECK(disc_sobol < 1.2 * disc_grid);
  CHECK(disc_sobol < 0.4 * disc_chance);
}
