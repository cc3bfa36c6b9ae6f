// Filtered queries: what footprints see, on what they do not depend.
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/texture/footprint.h"
#include "texture_queries.h"

using namespace texture_queries;

namespace {

Values filtered(const Texture& texture, const std::vector<float>& points,
                const std::vector<float>& radii) {
  const double origin[3] = {0, 0, 0};
  Values values(radii.size() * texture.model().channels.size());
  texture.eval_filtered(origin, points.data(), radii.data(), radii.size(), values.data());
  return values;
}

// Radii of all sizes, with none and infinity among them.
std::vector<float> mixed_radii(std::size_t count) {
  std::vector<float> radii;
  for (std::size_t i = 0; i < count; ++i)
    radii.push_back(0.05f * static_cast<float>(i % 37) * static_cast<float>(i % 11));
  radii[3] = std::numeric_limits<float>::infinity();
  return radii;
}

// The models, and with encoded albedo, whose values go below zero.
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

TEST_CASE("texture: no footprint gives the bits of points", "[texture]") {
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
  const Texture texture(tiny_field(), kSeed, kLargeCache);
  const std::size_t channels = texture.model().channels.size();
  // The voxels of the second level of the pyramid are looked up for 0.75 of the edge.
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

TEST_CASE("texture: a bad radius is named and nothing is written", "[texture]") {
  const auto points = random_points(20, 10);
  for (const float bad : {-1.0f, std::nanf("")}) {
    std::vector<float> radii(20, 1.0f);
    radii[7] = bad;
    const Texture texture(tiny_field(), kSeed, 0);
    CHECK(contains(message_of([&] { filtered(texture, points, radii); }), "radius of point 7 is"));
  }
}
