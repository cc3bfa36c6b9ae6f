// Jacobians: derivatives of the values of queries, for both families, with footprints and without.
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "engine/filter/footprint.h"
#include "every_target.h"
#include "texture_queries.h"

using namespace texture_queries;

namespace {

// Footprint of all points of a query.
struct Footprint {
  std::string name;
  float radius = 0;              // of cubes
  std::vector<float> axes = {};  // three axes, if not empty
};

const Footprint kPoint{"point"};

struct Found {
  Values values, jacobians;
};

Found evaluate(const Texture& texture, const std::array<double, 3>& origin, const Values& points,
               const Footprint& footprint, bool with_jacobians = true) {
  const std::size_t count = points.size() / 3, size = count * texture.model().channels.size();
  Found found{Values(size), Values(with_jacobians ? 3 * size : 0)};
  const OutputView output{found.values.data(), with_jacobians ? found.jacobians.data() : nullptr};
  if (!footprint.axes.empty()) {
    Values axes;
    for (std::size_t p = 0; p < count; ++p)
      axes.insert(axes.end(), footprint.axes.begin(), footprint.axes.end());
    texture.eval(origin.data(), points.data(), {.axes = axes.data()}, count, output);
  } else if (footprint.radius > 0) {
    const Values radii(count, footprint.radius);
    texture.eval(origin.data(), points.data(), {.radii = radii.data()}, count, output);
  } else {
    texture.eval(origin.data(), points.data(), {}, count, output);
  }
  return found;
}

std::vector<Footprint> footprints() {
  return {kPoint,
          {"small cube", 0.4f},
          {"cube", 2.5f},
          {"large cube", 9},
          {"slab", 0, {3, 0.5f, 0, -0.5f, 2, 1, 0, 0, 0.25f}},
          {"needle", 0, {7, 3, -2, 0, 0, 0, 0, 0, 0}}};
}

// Compares derivatives with differences to both sides. Differences have a rounding error of about
// 1e-7 / kStep and an error of kStep^2 / 6 times the third derivative. If they disagree with each
// other a plane between two cells or the edge of an activation lies between.
struct Agreement {
  std::size_t smooth = 0, wrong = 0, all = 0;
  float largest = 0;  // largest derivative
};

Agreement agreement_of(const Texture& texture, const Values& points, const Footprint& footprint) {
  constexpr float kStep = 1.0f / 128, kRounding = 4e-5f, kBend = 0.05f, kTwist = 6e-4f;
  const Found here = evaluate(texture, {}, points, footprint);
  Agreement result;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto moved = [&](float step) {
      Values to = points;
      for (std::size_t i = axis; i < to.size(); i += 3) to[i] += step;
      return evaluate(texture, {}, to, footprint, false).values;
    };
    const Values before = moved(-kStep), after = moved(kStep);
    for (std::size_t i = 0; i < before.size(); ++i) {
      const float derivative = here.jacobians[3 * i + axis], size = std::fabs(derivative);
      const float up = (after[i] - here.values[i]) / kStep;
      const float down = (here.values[i] - before[i]) / kStep;
      const float low = std::min(up, down), high = std::max(up, down);
      ++result.all;
      result.largest = std::max(result.largest, size);
      if (high - low > 2 * kRounding + kBend * size) continue;
      const float margin = kRounding + kTwist + 1e-3f * size;
      ++result.smooth;
      result.wrong += derivative < low - margin || derivative > high + margin;
    }
  }
  return result;
}

// Both families, with one channel of albedo encoded as sRGB.
std::vector<Model> encoded_models() {
  std::vector<Model> found = models();
  for (Model& model : found) {
    model.color_space = "srgb";
    model.channels[0] = "albedo.r";
  }
  return found;
}

// Multiples of 1/128: steps between them are exact.
Values places(std::size_t count, float extent) {
  Values points = random_points(count, extent, 4);
  for (float& c : points) c = std::round(128 * c) / 128;
  return points;
}

}  // namespace

TEST_CASE("jacobians: derivatives of values, with every footprint", "[jacobians]") {
  for (const Model& model : encoded_models()) {
    const Texture texture(model, kSeed, kLargeCache);
    for (const Footprint& footprint : footprints()) {
      const Agreement found = agreement_of(texture, places(200, 12), footprint);
      CAPTURE(model.name, footprint.name, found.wrong, found.smooth, found.all);
      CHECK(found.wrong <= found.smooth / 500);  // opposite bends on both sides
      CHECK(found.smooth > found.all / 2);
      CHECK(found.largest > 5e-4f);
    }
  }
}

TEST_CASE("jacobians: derivatives of the values of every shipped lattice", "[jacobians]") {
  std::size_t models = 0;
  for (const auto& entry : std::filesystem::directory_iterator(SOLIDTEX_MODELS)) {
    if (entry.path().extension() != ".solidtex") continue;
    Model model = read_model(entry.path());
    // Samplers have too many edges for single precision; tests/unit/test_sampler.cpp uses double.
    if (!std::holds_alternative<LatticeModel>(model.architecture)) continue;
    ++models;
    const Texture texture(std::move(model), kSeed, kLargeCache);
    const Agreement found = agreement_of(texture, places(60, 6), kPoint);
    CAPTURE(entry.path(), found.wrong, found.smooth, found.all);
    CHECK(found.wrong == 0);
    CHECK(found.smooth > found.all / 2);
    CHECK(found.largest > 1e-2f);
  }
  CHECK(models > 3);
}

TEST_CASE("jacobians: they change no value, and nothing changes them", "[jacobians]") {
  const std::array<double, 3> far = {1e6, -7e5, 0x1p29};
  const Values points = random_points(500, 6);
  for (const Model& model : encoded_models()) {
    const std::size_t channels = model.channels.size();
    const Texture texture(model, kSeed, kLargeCache);
    std::vector<Found> together;
    for (const Footprint& footprint : footprints()) {
      together.push_back(evaluate(texture, far, points, footprint));
      const Found& all = together.back();
      CAPTURE(model.name, footprint.name);
      CHECK(same(all.values, evaluate(texture, far, points, footprint, false).values));
      for (const std::size_t first : {0, 49, 133}) {
        for (const std::size_t count : {1, 48, 301}) {
          const auto begin = points.begin() + static_cast<std::ptrdiff_t>(3 * first);
          const Found part = evaluate(
              texture, far, {begin, begin + static_cast<std::ptrdiff_t>(3 * count)}, footprint);
          CHECK(std::equal(part.jacobians.begin(), part.jacobians.end(),
                           &all.jacobians[3 * channels * first]));
        }
      }
    }
    testing::on_every_target([&] {
      const Texture again(model, kSeed, kLargeCache);
      tbb::task_arena(3).execute([&] {
        for (std::size_t i = 0; i < together.size(); ++i) {
          const Found found = evaluate(again, far, points, footprints()[i]);
          CHECK(same(found.values, together[i].values));
          CHECK(same(found.jacobians, together[i].jacobians));
        }
      });
    });
  }
}

TEST_CASE("jacobians: those of an endless footprint are zero", "[jacobians]") {
  for (const Model& model : encoded_models()) {
    const Texture texture(model, kSeed, kLargeCache);
    const Footprint endless{"endless", std::numeric_limits<float>::infinity()};
    for (const float negative_slope : evaluate(texture, {}, places(20, 9), endless).jacobians)
      CHECK(negative_slope == 0);
  }
}

TEST_CASE("jacobians: those of albedo convert to linear light and back", "[jacobians]") {
  const LightChannels light({"albedo.r", "height"}, "srgb");
  float values[4] = {0.5f, 0.5f, -0.5f, -0.5f};
  float jacobians[12] = {1, 2, 3, 1, 2, 3, 1, 2, 3, 1, 2, 3};
  const OutputView output(values, jacobians);
  light.to_light(output, 2);
  CHECK(std::vector(values, values + 4) == Values{0.25f, 0.5f, 0, -0.5f});
  CHECK(std::vector(jacobians, jacobians + 12) == Values{1, 2, 3, 1, 2, 3, 0, 0, 0, 1, 2, 3});
  jacobians[0] = 4;
  light.from_light(output, 2);
  CHECK(std::vector(values, values + 4) == Values{0.5f, 0.5f, 0, -0.5f});
  CHECK(std::vector(jacobians, jacobians + 12) == Values{4, 2, 3, 1, 2, 3, 0, 0, 0, 1, 2, 3});
}
