// Queries with footprints: their values, and what these do not depend on.
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "engine/filter/footprint.h"
#include "texture_queries.h"

using namespace texture_queries;

namespace {

Values filtered(const Texture& texture, const std::vector<float>& points,
                const std::vector<float>& radii) {
  const double origin[3] = {0, 0, 0};
  Values values(radii.size() * texture.model().channels.size());
  texture.eval(origin, points.data(), {.radii = radii.data()}, radii.size(), values.data());
  return values;
}

Values footprints(const Texture& texture, const std::vector<float>& points,
                  const std::vector<float>& axes) {
  const double origin[3] = {0, 0, 0};
  Values values(points.size() / 3 * texture.model().channels.size());
  texture.eval(origin, points.data(), {.axes = axes.data()}, points.size() / 3, values.data());
  return values;
}

std::vector<float> cubes(const std::vector<float>& radii) {
  std::vector<float> axes;
  for (const float r : radii) axes.insert(axes.end(), {r, 0, 0, 0, r, 0, 0, 0, r});
  return axes;
}

// Boxes, slabs, needles and points, with an infinite and a denormal one.
std::vector<float> mixed_axes(std::size_t count) {
  std::mt19937 random(9);
  std::uniform_real_distribution<float> component(-1, 1);
  std::vector<float> axes;
  for (std::size_t i = 0; i < 3 * count; ++i) {
    const float size = 0.3f * static_cast<float>(i * i % 23) * static_cast<float>(i % 4 != 0);
    for (int k = 0; k < 3; ++k) axes.push_back(size * component(random));
  }
  axes[9 * 5 + 4] = -std::numeric_limits<float>::infinity();
  std::fill_n(&axes[9 * 6], 9, 1e-42f);
  std::fill_n(&axes[9 * 7], 9, 0.0f);
  return axes;
}

using Vector = std::array<double, 3>;

Vector scaled(const Vector& v, double factor) {
  return {v[0] * factor, v[1] * factor, v[2] * factor};
}

// Returns two orthogonal directions.
std::array<Vector, 2> random_plane(std::mt19937& random) {
  std::normal_distribution<double> normal;
  Vector a = {normal(random), normal(random), normal(random)};
  Vector b = {normal(random), normal(random), normal(random)};
  const auto dot = [](const Vector& u, const Vector& v) {
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
  };
  a = scaled(a, 1 / std::sqrt(dot(a, a)));
  const double share = dot(a, b);
  for (std::size_t k = 0; k < 3; ++k) b[k] -= share * a[k];
  return {a, scaled(b, 1 / std::sqrt(dot(b, b)))};
}

struct Errors {
  double cube = 0, axes = 0;  // sums of squares
};

// Errors of means over parallelograms `width` texels wide and `aspect` times as long, by a cube of
// equal area and by axes, against a grid of points.
Errors errors_of(const Texture& texture, double width, double aspect) {
  constexpr int kPlaces = 40, kFine = 8, kLong = 128;
  const std::size_t channels = texture.model().channels.size();
  std::mt19937 random(3);
  Errors errors;
  for (int place = 0; place < kPlaces; ++place) {
    const std::vector<float> middle = random_points(1, 400, static_cast<unsigned>(place));
    const auto plane = random_plane(random);
    const Vector a = scaled(plane[0], width * aspect / 2), b = scaled(plane[1], width / 2);
    std::vector<float> grid;
    for (int u = 1 - kLong; u < kLong; u += 2)
      for (int v = 1 - kFine; v < kFine; v += 2)
        for (std::size_t k = 0; k < 3; ++k)
          grid.push_back(middle[k] + static_cast<float>(u * a[k] / kLong + v * b[k] / kFine));
    const Values points = points_of(texture, {0, 0, 0}, grid);
    std::vector<float> axes(9, 0.0f);
    std::copy(a.begin(), a.end(), axes.begin());
    std::copy(b.begin(), b.end(), axes.begin() + 3);
    const auto radius = static_cast<float>(width * std::sqrt(aspect) / 2);
    const Values by_cube = filtered(texture, middle, {radius});
    const Values by_axes = footprints(texture, middle, axes);
    for (std::size_t c = 0; c < channels; ++c) {
      double sum = 0;
      for (std::size_t i = c; i < points.size(); i += channels) sum += points[i];
      const double mean = sum / (kFine * kLong);
      errors.cube += std::pow(by_cube[c] - mean, 2);
      errors.axes += std::pow(by_axes[c] - mean, 2);
    }
  }
  return errors;
}

// Radii of all sizes, zero and infinity included.
std::vector<float> mixed_radii(std::size_t count) {
  std::vector<float> radii;
  for (std::size_t i = 0; i < count; ++i)
    radii.push_back(0.05f * static_cast<float>(i % 37) * static_cast<float>(i % 11));
  radii[3] = std::numeric_limits<float>::infinity();
  return radii;
}

// The models with albedo encoded as sRGB and values below zero.
std::vector<Model> encoded_models() {
  std::vector<Model> result;
  for (Model model : models()) {
    model.color_space = "srgb";
    for (std::size_t c = 0; c < model.channels.size(); ++c)
      model.channels[c] = "albedo." + std::to_string(c);
    result.push_back(std::move(model));
  }
  return result;
}

}  // namespace

TEST_CASE("texture: an empty footprint gives the bits of points", "[texture]") {
  const auto points = random_points(500, 10);
  for (const Model& model : encoded_models()) {
    const Texture texture(model, kSeed, kLargeCache);
    const Values expected = points_of(texture, {0, 0, 0}, points);
    CHECK(same(filtered(texture, points, std::vector<float>(500, 0.0f)), expected));
    const std::size_t channels = model.channels.size();
    std::vector<float> radii(500, 0.0f);
    for (std::size_t i = 0; i < 500; i += 2) radii[i] = 3;
    const Values mixed = filtered(texture, points, radii);
    for (std::size_t i = channels; i < mixed.size(); i += 2 * channels)
      CHECK(std::equal(&mixed[i], &mixed[i] + channels, &expected[i]));
  }
}

TEST_CASE("texture: footprints do not depend on batch, cache, threads and order", "[texture]") {
  const auto points = random_points(300, 40);
  const auto radii = mixed_radii(300);
  for (const Model& model : encoded_models()) {
    const Values expected = filtered(Texture(model, kSeed, kLargeCache), points, radii);
    const std::size_t channels = model.channels.size();
    for (const std::uint64_t cache : {std::uint64_t{0}, kLargeCache}) {
      const Texture texture(model, kSeed, cache);
      tbb::task_arena arena(3);
      CHECK(same(arena.execute([&] { return filtered(texture, points, radii); }), expected));
      for (std::size_t i = 299; i > 200; i -= 9) {
        const std::vector<float> point(&points[3 * i], &points[3 * i] + 3);
        const Values alone = filtered(texture, point, {radii[i]});
        CHECK(std::equal(alone.begin(), alone.end(), &expected[i * channels]));
      }
    }
  }
}

TEST_CASE("texture: a footprint of voxels is their mean, an infinite one the material's",
          "[texture]") {
  const Texture texture(tiny_lattice(), kSeed, kLargeCache);
  const std::size_t channels = texture.model().channels.size();
  // A quarter less than the edge of the footprint selects the second level of the pyramid.
  const float radius = 4 / 0.75f / 2;
  const LightChannels light(texture.model().channels, texture.model().color_space);
  Values found = filtered(texture, {-6, 10, 2}, {radius});
  light.to_light(found.data(), 1);
  Values box = box_of(texture, {-8, 8, 0}, {4, 4, 4});
  light.to_light(box.data(), 64);
  for (std::size_t c = 0; c < channels; ++c) {
    double sum = 0;
    for (std::size_t i = c; i < box.size(); i += channels) sum += box[i];
    CHECK(found[c] == Approx(sum / 64).margin(1e-6));
  }
  for (const Model& model : models()) {
    const Texture endless(model, kSeed, kLargeCache);
    Values mean = filtered(endless, {0, 0, 0, 500, 20, 3}, {1e9f, INFINITY});
    Values block = box_of(endless, {0, 0, 0}, {48, 48, 48});
    const LightChannels light(model.channels, model.color_space);
    light.to_light(block.data(), block.size() / model.channels.size());
    light.to_light(mean.data(), 2);
    const std::size_t count = model.channels.size();
    for (std::size_t c = 0; c < count; ++c) {
      CHECK(mean[c] == mean[count + c]);
      double sum = 0, squares = 0;
      for (std::size_t i = c; i < block.size(); i += count) {
        sum += block[i];
        squares += block[i] * block[i];
      }
      const double voxels = static_cast<double>(block.size() / count);
      const double deviation =
          std::sqrt(std::max(0.0, squares / voxels - sum * sum / voxels / voxels));
      CHECK(mean[c] == Approx(sum / voxels).margin(0.3 * deviation + 1e-6));
    }
  }
}

TEST_CASE("texture: encoded albedo is averaged as light, other channels as they are", "[texture]") {
  const LightChannels light({"albedo.r", "roughness"}, "srgb");
  Values values = {0.5f, 0.5f, -0.25f, -0.25f, 1, 1};
  light.to_light(values.data(), 3);
  CHECK(values == Values{0.25f, 0.5f, 0, -0.25f, 1, 1});
  light.from_light(values.data(), 3);
  CHECK(values == Values{0.5f, 0.5f, 0, -0.25f, 1, 1});
  Values linear = {0.5f};
  LightChannels({"albedo.r"}, "linear").to_light(linear.data(), 1);
  CHECK(linear == Values{0.5f});
}

TEST_CASE("texture: three axes of a cube give the bits of its radius", "[texture]") {
  const auto points = random_points(300, 40);
  const auto radii = mixed_radii(300);
  for (const Model& model : encoded_models()) {
    const Texture texture(model, kSeed, kLargeCache);
    CHECK(same(footprints(texture, points, cubes(radii)), filtered(texture, points, radii)));
    CHECK(same(footprints(texture, points, std::vector<float>(2700, 0.0f)),
               points_of(texture, {0, 0, 0}, points)));
  }
}

TEST_CASE("texture: an almost cubic footprint is almost a cube, in every order of its axes",
          "[texture]") {
  const auto points = random_points(60, 40);
  for (const Model& model : encoded_models()) {
    const Texture texture(model, kSeed, kLargeCache);
    const Values cube = filtered(texture, points, std::vector<float>(60, 2.0f));
    std::vector<float> axes;
    for (int i = 0; i < 60; ++i) axes.insert(axes.end(), {0, -2.0001f, 0, 0, 0, 2, 2, 0, 0});
    const Values found = footprints(texture, points, axes);
    for (std::size_t i = 0; i < cube.size(); ++i) CHECK(found[i] == Approx(cube[i]).margin(0.002));
  }
}

TEST_CASE("texture: axes do not depend on batch, origin, cache, threads and order", "[texture]") {
  const auto points = random_points(300, 40);
  const auto axes = mixed_axes(300);
  for (const Model& model : encoded_models()) {
    const Values expected = footprints(Texture(model, kSeed, kLargeCache), points, axes);
    CHECK(std::ranges::all_of(expected, [](float value) { return std::isfinite(value); }));
    const std::size_t channels = model.channels.size();
    for (const std::uint64_t cache : {std::uint64_t{0}, kLargeCache}) {
      const Texture texture(model, kSeed, cache);
      tbb::task_arena arena(3);
      CHECK(same(arena.execute([&] { return footprints(texture, points, axes); }), expected));
      for (std::size_t i = 299; i > 200; i -= 9) {
        const double origin[3] = {points[3 * i], points[3 * i + 1], points[3 * i + 2]};
        const float zero[3] = {0, 0, 0};
        Values alone(channels);
        texture.eval(origin, zero, {.axes = &axes[9 * i]}, 1, alone.data());
        CHECK(std::equal(alone.begin(), alone.end(), &expected[i * channels]));
      }
    }
  }
}

TEST_CASE("texture: a footprint is the mean of its parts", "[texture]") {
  // Two cubes side by side.
  const Texture texture(tiny_lattice(), kSeed, kLargeCache);
  const Values found = footprints(texture, {3, 5, 7}, {2, 0, 0, 0, 1, 0, 0, 0, 1});
  const Values parts = filtered(texture, {2, 5, 7, 4, 5, 7}, {1, 1});
  for (std::size_t c = 0; c < 2; ++c) CHECK(found[c] == Approx((parts[c] + parts[2 + c]) / 2));
}

TEST_CASE("texture: axes approximate an oblique footprint better than a cube does", "[texture]") {
  for (const Model& model : models()) {
    const Texture texture(model, kSeed, kLargeCache);
    for (const double width : {1.0, 2.0}) {
      for (const double aspect : {4.0, 16.0}) {
        const Errors errors = errors_of(texture, width, aspect);
        CAPTURE(model.name, width, aspect, std::sqrt(errors.cube), std::sqrt(errors.axes));
        CHECK(std::sqrt(errors.axes) < 0.7 * std::sqrt(errors.cube));
      }
    }
  }
}

TEST_CASE("texture: an endless axis gives the mean of the material", "[texture]") {
  for (const Model& model : encoded_models()) {
    const Texture texture(model, kSeed, kLargeCache);
    const Values mean = filtered(texture, {1, 2, 3}, {INFINITY});
    for (const float endless : {INFINITY, -INFINITY, 1e30f, 4096.0f})
      CHECK(same(footprints(texture, {70, 2, 3}, {0, 0, 0, 0, endless, 0, 0, 1, 0}), mean));
  }
}

TEST_CASE("texture: an axis with a NaN is named", "[texture]") {
  std::vector<float> axes(9 * 20, 1.0f);
  axes[9 * 7 + 5] = std::nanf("");
  for (const Model& model : models()) {
    const Texture texture(model, kSeed, 0);
    CHECK(contains(message_of([&] { footprints(texture, random_points(20, 10), axes); }),
                   "axis 1 of point 7: z is no number"));
  }
}

TEST_CASE("texture: a bad radius is named and nothing is written", "[texture]") {
  const auto points = random_points(20, 10);
  for (const float bad : {-1.0f, std::nanf("")}) {
    std::vector<float> radii(20, 1.0f);
    radii[7] = bad;
    const Texture texture(tiny_lattice(), kSeed, 0);
    CHECK(contains(message_of([&] { filtered(texture, points, radii); }), "radius of point 7 is"));
  }
}
