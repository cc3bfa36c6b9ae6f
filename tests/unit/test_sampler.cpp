#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <random>

#include "catch.hpp"
#include "engine/noise/noise.h"
#include "engine/sampler/sampler.h"
#include "tests/unit/every_target.h"
#include "tests/unit/example_models.h"

using namespace solidtex::engine;

namespace {

constexpr std::uint64_t kSeed = 11;

std::vector<double> random_positions(std::size_t count, double center) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> offset(-200, 200);
  std::vector<double> positions(3 * count);
  for (double& p : positions) p = center + offset(random);
  return positions;
}

std::vector<float> evaluate(const Sampler& sampler, const std::vector<double>& positions) {
  const std::size_t count = positions.size() / 3;
  std::vector<float> values(count * static_cast<std::size_t>(sampler.channels()));
  sampler.evaluate(positions.data(), count, values.data());
  return values;
}

struct Jacobians {
  std::vector<float> values, jacobians;
};

Jacobians jacobians_of(const Sampler& sampler, const std::vector<double>& positions) {
  const std::size_t count = positions.size() / 3;
  Jacobians found;
  found.values.resize(count * static_cast<std::size_t>(sampler.channels()));
  found.jacobians.resize(3 * found.values.size());
  sampler.evaluate_faded(positions.data(), nullptr, count, found.values.data(),
                         found.jacobians.data());
  return found;
}

// Equation 2 of GramGAN in double, without folding.
std::vector<double> by_definition(const SamplerModel& model, const double* at) {
  const auto octave = [&](int i) {
    const NoiseStream noise(NoiseScheme::solidtex_1, kSeed, static_cast<std::uint32_t>(i), 0);
    double cell[3], f[3];
    for (int axis = 0; axis < 3; ++axis) {
      const float* row = &model.transforms.values[static_cast<std::size_t>(9 * i + 3 * axis)];
      const double c = row[0] * at[0] + row[1] * at[1] + row[2] * at[2];
      cell[axis] = std::floor(c);
      f[axis] = c - cell[axis];
    }
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
      double weight = 1;
      std::int32_t j[3];
      for (int axis = 0; axis < 3; ++axis) {
        const int up = corner >> axis & 1;
        weight *= up ? f[axis] : 1 - f[axis];
        j[axis] = static_cast<std::int32_t>(cell[axis]) + up;
      }
      sum += weight * noise.normal(j[0], j[1], j[2]);
    }
    return sum;
  };
  std::vector<double> x(model.constant.values.begin(), model.constant.values.end());
  const auto product = [&x](const Tensor& weight, const Tensor& bias) {
    std::vector<double> y(bias.values.begin(), bias.values.end());
    for (std::size_t o = 0; o < y.size(); ++o)
      for (std::size_t i = 0; i < x.size(); ++i) y[o] += x[i] * weight.values[o * x.size() + i];
    return y;
  };
  const auto per_layer = static_cast<std::size_t>(model.octaves) / (model.hidden.size() - 1);
  for (std::size_t l = 0; l < model.hidden.size(); ++l) {
    const auto& layer = model.hidden[l];
    std::vector<double> y = product(layer.weight, layer.bias);
    for (std::size_t o = 0; o < y.size() && l + 1 < model.hidden.size(); ++o)
      for (std::size_t i = 0; i < per_layer; ++i)
        y[o] += octave(static_cast<int>(l * per_layer + i)) * layer.noise.values[o * per_layer + i];
    for (double& v : y) v = v > 0 ? v : model.negative_slope * v;
    x = y;
  }
  return product(model.output_weight, model.output_bias);
}

// Units and octaves that fill no tile and no vector, or more than one.
std::vector<SamplerModel> odd_models() {
  return {example::sampler(), example::sampler(3, 2, 5, 4), example::sampler(4, 3, 33, 1),
          example::sampler(1, 2, 1, 1), example::sampler(20, 2, 40, 20)};
}

}  // namespace

TEST_CASE("the sampler is equation 2 of GramGAN", "[sampler]") {
  for (const SamplerModel& model : odd_models()) {
    const Sampler sampler(model, NoiseScheme::solidtex_1, kSeed);
    const std::vector<double> positions = random_positions(100, -20);
    const std::vector<float> values = evaluate(sampler, positions);
    const auto channels = static_cast<std::size_t>(sampler.channels());
    for (std::size_t p = 0; p < 100; ++p) {
      const std::vector<double> expected = by_definition(model, &positions[3 * p]);
      for (std::size_t c = 0; c < channels; ++c)
        CHECK(values[p * channels + c] == Approx(expected[c]).margin(2e-5));
    }
  }
}

TEST_CASE("jacobians are the derivatives of equation 2", "[sampler]") {
  constexpr double kStep = 1e-6;
  std::vector<SamplerModel> models = odd_models();
  for (const auto& entry : std::filesystem::directory_iterator(SOLIDTEX_MODELS)) {
    if (entry.path().extension() != ".solidtex") continue;
    Model file = read_model(entry.path());
    if (auto* shipped = std::get_if<SamplerModel>(&file.architecture)) models.push_back(*shipped);
  }
  CHECK(models.size() > odd_models().size() + 2);
  for (const SamplerModel& model : models) {
    const Sampler sampler(model, NoiseScheme::solidtex_1, kSeed);
    const std::size_t count = model.width < 64 ? 100 : 20;
    const std::vector<double> positions = random_positions(count, -20);
    const Jacobians found = jacobians_of(sampler, positions);
    CHECK(found.values == evaluate(sampler, positions));
    const auto channels = static_cast<std::size_t>(sampler.channels());
    float largest = 0;
    // Rounding moves values within about 1e-7 of an activation's edge to its other side.
    std::size_t wrong = 0;
    for (std::size_t p = 0; p < count; ++p)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        std::array<double, 3> low, high;
        std::copy_n(&positions[3 * p], 3, low.begin());
        high = low;
        low[axis] -= kStep, high[axis] += kStep;
        const std::vector<double> before = by_definition(model, low.data());
        const std::vector<double> after = by_definition(model, high.data());
        for (std::size_t c = 0; c < channels; ++c) {
          const float derivative = found.jacobians[3 * (p * channels + c) + axis];
          wrong += derivative != Approx((after[c] - before[c]) / (2 * kStep)).margin(2e-5);
          largest = std::max(largest, std::fabs(derivative));
        }
      }
    CAPTURE(model.width, wrong, count);
    CHECK(wrong <= count / 20);
    CHECK(largest > 0.05f);
  }
}

TEST_CASE("a jacobian's bits depend neither on its neighbors nor on the target", "[sampler]") {
  const std::vector<double> positions = random_positions(150, 1e6);
  for (const SamplerModel& model : odd_models()) {
    const Sampler sampler(model, NoiseScheme::solidtex_1, kSeed);
    const auto channels = static_cast<std::size_t>(sampler.channels());
    const Jacobians together = jacobians_of(sampler, positions);
    testing::on_every_target([&] {
      CHECK(jacobians_of(sampler, positions).jacobians == together.jacobians);
      for (const std::size_t first : {0, 1, 47, 101})
        for (const std::size_t count : {1, 2, 17, 49}) {
          const auto begin = positions.begin() + static_cast<std::ptrdiff_t>(3 * first);
          const Jacobians part =
              jacobians_of(sampler, {begin, begin + static_cast<std::ptrdiff_t>(3 * count)});
          CAPTURE(first, count);
          CHECK(std::equal(part.values.begin(), part.values.end(),
                           &together.values[channels * first]));
          CHECK(std::equal(part.jacobians.begin(), part.jacobians.end(),
                           &together.jacobians[3 * channels * first]));
        }
    });
  }
}

TEST_CASE("a point's bits do not depend on the target", "[sampler]") {
  for (const SamplerModel& model : odd_models()) {
    const Sampler sampler(model, NoiseScheme::solidtex_1, kSeed);
    for (const double center : {0.0, -0x1p30, 0x1p30}) {
      const std::vector<double> positions = random_positions(301, center);
      const std::vector<float> together = evaluate(sampler, positions);
      testing::on_every_target([&] { CHECK(evaluate(sampler, positions) == together); });
    }
  }
}

TEST_CASE("a point's bits do not depend on its neighbors, in either precision", "[sampler]") {
  const std::vector<double> positions = random_positions(301, 1e6);
  for (const SamplerModel& model : odd_models())
    for (const Precision precision : {Precision::full, Precision::fast})
      testing::on_every_target([&] {
        const Sampler sampler(model, NoiseScheme::solidtex_1, kSeed, precision);
        const auto channels = static_cast<std::size_t>(sampler.channels());
        const std::vector<float> together = evaluate(sampler, positions);
        for (const std::size_t first : {0, 1, 47, 48, 49, 250}) {
          for (const std::size_t count : {1, 2, 4, 5, 17, 49, 51}) {
            const std::vector<float> part = evaluate(
                sampler, {positions.begin() + static_cast<std::ptrdiff_t>(3 * first),
                          positions.begin() + static_cast<std::ptrdiff_t>(3 * (first + count))});
            CAPTURE(first, count);
            CHECK(std::equal(part.begin(), part.end(),
                             together.begin() + static_cast<std::ptrdiff_t>(channels * first)));
          }
        }
      });
}

TEST_CASE("fast precision is near full precision", "[sampler]") {
  for (const char* name : {"stone-grey", "wood-zebrano"}) {
    const Model file = read_model(std::string(SOLIDTEX_MODELS) + "/" + name + ".solidtex");
    const auto& model = std::get<SamplerModel>(file.architecture);
    const std::vector<double> positions = random_positions(4000, 7);
    const auto values_in = [&](Precision precision) {
      return evaluate(Sampler(model, NoiseScheme::solidtex_1, kSeed, precision), positions);
    };
    const std::vector<float> full = values_in(Precision::full), fast = values_in(Precision::fast);
    float largest = 0;
    for (std::size_t i = 0; i < full.size(); ++i)
      largest = std::max(largest, std::fabs(fast[i] - full[i]));
    CHECK(largest < 1.0f / 255);  // docs/numerics.md requires this of 99.9 % of the values
  }
  for (const SamplerModel& model : odd_models()) {
    const std::vector<double> positions = random_positions(100, 7);
    const auto values_in = [&](Precision precision) {
      return evaluate(Sampler(model, NoiseScheme::solidtex_1, kSeed, precision), positions);
    };
    const std::vector<float> full = values_in(Precision::full), fast = values_in(Precision::fast);
    for (std::size_t i = 0; i < full.size(); ++i)
      CHECK(fast[i] == Approx(full[i]).epsilon(0.01).margin(0.02));
  }
}

TEST_CASE("fast precision is another computation where the processor has a matrix unit",
          "[sampler]") {
  const std::vector<double> positions = random_positions(50, 7);
  const auto values_in = [&](Precision precision) {
    return evaluate(Sampler(example::sampler(), NoiseScheme::solidtex_1, kSeed, precision),
                    positions);
  };
  const bool same = values_in(Precision::full) == values_in(Precision::fast);
  CHECK(same != MatrixNetwork::supported());
}

TEST_CASE("far positions are distinct and finite", "[sampler]") {
  const Sampler sampler(example::sampler(), NoiseScheme::solidtex_1, kSeed);
  const std::vector<float> values =
      evaluate(sampler, {0x1p30, 0, 0, 0x1p30 + 1, 0, 0, 1e300, -1e300, 1e200,
                         std::numeric_limits<double>::infinity(), 0, 0});
  CHECK(values[0] != values[3]);
  for (std::size_t i = 0; i < 9; ++i) CHECK(std::isfinite(values[i]));
}

TEST_CASE("the sampler refuses a scheme without normal noise", "[sampler]") {
  CHECK_THROWS(Sampler(example::sampler(), NoiseScheme::solidtexturenets, 0));
}
