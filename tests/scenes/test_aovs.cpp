// AOVs: values, independence of each other, files, visualizations, view transforms.
#include <OpenImageIO/imageio.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "catch.hpp"
#include "tests/scenes/support.h"

using namespace scene_tests;

namespace {

constexpr int kSize = 32;

// A floor with a solid texture that fills the lower half of the image.
pt::Scene floor_scene(const TemporaryFolder& folder) {
  write_noise_model(folder / "noise.solidtex", 3);
  pt::Material material;
  material.color = pt::SolidColor{
      0, false, glm::translate(glm::scale(glm::dmat4(1), glm::dvec3(8)), {100, 200, 300})};
  pt::Scene scene = make_scene(make_quad(50), material, {0, 3, 10}, 40);
  scene.camera.look_at = {0, 3, 0};
  scene.textures.emplace_back((folder / "noise.solidtex").string());
  scene.environment = uniform_light({0.2f, 0.3f, 0.4f});
  return scene;
}

pt::AovSet every_aov() {
  pt::AovSet aovs;
  for (const pt::AovInfo& aov : pt::all_aovs()) aovs.add(aov.aov);
  return aovs;
}

pt::AovImage render_aovs(const pt::Scene& scene, pt::RenderSettings settings,
                         const pt::AovSet& aovs) {
  settings.aovs = aovs;
  pt::Renderer renderer(scene, settings);
  CHECK(renderer.render());
  CHECK(renderer.remaining_samples() == 0);
  return renderer.image();
}

glm::vec3 pixel(const pt::AovImage& picture, pt::Aov aov, int x, int y) {
  const auto i = static_cast<std::size_t>(y * picture.window.width() + x) * 3;
  const auto& values = picture.values(aov);
  return {values[i], values[i + 1], values[i + 2]};
}

float value(const pt::AovImage& picture, pt::Aov aov, int x, int y) {
  return picture.values(aov)[static_cast<std::size_t>(y * picture.window.width() + x)];
}

}  // namespace

TEST_CASE("AOVs hold the geometry of the first hit") {
  const TemporaryFolder folder;
  const pt::AovImage picture =
      render_aovs(floor_scene(folder), small_settings(kSize, 16), every_aov());
  const int x = 20, y = 28;
  // The floor at the pixel's center; the tent filter averages around it.
  const float pixel_size = 2 * std::tan(glm::radians(20.0f)) / kSize;
  const float slope = (static_cast<float>(y) + 0.5f - kSize / 2.0f) * pixel_size;
  const float depth = 3 / slope;
  const glm::vec3 expected((static_cast<float>(x) + 0.5f - kSize / 2.0f) * pixel_size * depth, 0,
                           10 - depth);
  const glm::vec3 position = pixel(picture, pt::Aov::position, x, y);
  CHECK(value(picture, pt::Aov::depth, x, y) == Approx(depth).epsilon(0.02));
  CHECK(glm::length(position - expected) < 0.02f * depth);
  CHECK(glm::length(pixel(picture, pt::Aov::normal, x, y) - glm::vec3(0, 1, 0)) < 1e-5f);
  const glm::vec3 texels = 8.0f * (position + glm::vec3(100, 200, 300));
  CHECK(glm::length(pixel(picture, pt::Aov::texcoord, x, y) - texels) < 0.01f);
  // The cone of one of 16 samples: 1 / sqrt(16) of half the pixel's width, times 8 texels per unit.
  const float across = 8 * depth * pixel_size / 2 / 4;
  CHECK(value(picture, pt::Aov::footprint, x, y) > across);
  CHECK(value(picture, pt::Aov::footprint, x, y) < 4 * across);
  CHECK(value(picture, pt::Aov::samples, x, y) == 16);
  CHECK(value(picture, pt::Aov::cost, x, y) == 1);  // a plane is hit once

  // The background.
  CHECK(std::isinf(value(picture, pt::Aov::depth, x, 3)));
  for (const pt::Aov aov : {pt::Aov::albedo, pt::Aov::normal, pt::Aov::position, pt::Aov::texcoord,
                            pt::Aov::variance}) {
    CHECK(pixel(picture, aov, x, 3) == glm::vec3(0));
  }
  CHECK(value(picture, pt::Aov::cost, x, 3) == 0);
}

TEST_CASE("The cost AOV adds up to the evaluated texture points") {
  const TemporaryFolder folder;
  pt::Scene scene = floor_scene(folder);
  scene.meshes.push_back(make_sphere(8));
  scene.objects.push_back({1, 0, glm::translate(glm::mat4(1), {0, 1.2f, 4})});
  for (const bool has_bump : {false, true}) {
    if (has_bump) scene.materials[0].bump = pt::Bump{0, 0.1f};
    pt::RenderSettings settings = small_settings(kSize, 4);
    settings.aovs = {pt::Aov::cost};
    pt::Renderer renderer(scene, settings);
    CHECK(renderer.render());
    double points = 0;
    const pt::AovImage picture = renderer.image();
    for (const float mean : picture.values(pt::Aov::cost)) points += 4 * mean;
    CHECK(points > kSize * kSize);
    CHECK(points == Approx(renderer.statistics().texture_point_count));
  }
}

TEST_CASE("Under constant light a diffuse plane's albedo is its beauty over the light") {
  const TemporaryFolder folder;
  const pt::AovImage picture =
      render_aovs(floor_scene(folder), small_settings(kSize, 16), every_aov());
  const glm::vec3 light(0.2f, 0.3f, 0.4f);
  const glm::vec3 albedo = pixel(picture, pt::Aov::albedo, 10, 28);
  CHECK(albedo.x > 0.05f);
  CHECK(glm::length(pixel(picture, pt::Aov::beauty, 10, 28) - albedo * light) < 0.01f);
}

TEST_CASE("The bits of an AOV do not depend on other AOVs") {
  const TemporaryFolder folder;
  const pt::Scene scene = floor_scene(folder);
  const pt::RenderSettings settings = small_settings(kSize, 4);
  const pt::AovImage all = render_aovs(scene, settings, every_aov());
  for (const pt::AovInfo& aov : pt::all_aovs()) {
    CAPTURE(aov.name);
    const pt::AovImage alone = render_aovs(scene, settings, {aov.aov});
    CHECK(alone.planes.size() == 1);
    CHECK(alone.values(aov.aov) == all.values(aov.aov));
  }
  CHECK(pt::render(scene, settings).rgb == all.values(pt::Aov::beauty));
}

TEST_CASE("The variance AOV is the variance of the mean over seeds") {
  pt::Scene scene = make_scene(make_sphere(16), {}, {0, 0, 4}, 40);
  scene.lights.push_back({{-1, 3, -1}, {2, 0, 0}, {0, 0, 2}, glm::vec3(4)});
  scene.environment = uniform_light({0.1f, 0.1f, 0.1f});
  pt::RenderSettings settings = small_settings(kSize, 8);
  // Samples are stratified, so the true variance is below the estimate.
  settings.light_sampling = pt::LightSampling::bsdf;
  constexpr int kSeeds = 40;
  std::vector<double> sum(kSize * kSize * 3), squares(sum.size());
  double estimated = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    settings.seed = static_cast<std::uint64_t>(seed);
    const pt::AovImage picture = render_aovs(scene, settings, {pt::Aov::beauty, pt::Aov::variance});
    for (std::size_t i = 0; i < sum.size(); ++i) {
      const double mean = picture.values(pt::Aov::beauty)[i];
      sum[i] += mean, squares[i] += mean * mean;
      estimated += picture.values(pt::Aov::variance)[i] / kSeeds;
    }
  }
  double seen = 0;
  for (std::size_t i = 0; i < sum.size(); ++i) {
    seen += (squares[i] - sum[i] * sum[i] / kSeeds) / (kSeeds - 1);
  }
  CAPTURE(seen, estimated);
  CHECK(seen > 0.4 * estimated);
  CHECK(seen < 1.1 * estimated);
}

TEST_CASE("An EXR names the channels of its AOVs and keeps a crop window's position") {
  const TemporaryFolder folder;
  pt::RenderSettings settings = small_settings(kSize, 2);
  settings.crop = {5, 9, 25, 30};
  const pt::AovImage picture = render_aovs(floor_scene(folder), settings, every_aov());
  pt::write_exr(picture, folder / "all.exr");
  const auto input = OIIO::ImageInput::open((folder / "all.exr").string());
  REQUIRE(input);
  const OIIO::ImageSpec& spec = input->spec();
  CHECK(std::vector{spec.x, spec.y, spec.width, spec.height} == std::vector{5, 9, 20, 21});
  CHECK(std::vector{spec.full_width, spec.full_height} == std::vector{kSize, kSize});
  std::vector<float> values(static_cast<std::size_t>(20 * 21 * spec.nchannels));
  REQUIRE(input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, values.data()));
  std::size_t found = 0;
  for (const auto& plane : picture.planes) {
    const auto& names = pt::info(plane.aov).channels;
    for (std::size_t c = 0; c < names.size(); ++c) {
      CAPTURE(names[c]);
      const int channel = spec.channelindex(names[c]);
      REQUIRE(channel >= 0);
      bool same = true;
      for (std::size_t i = 0; i < 20 * 21; ++i) {
        same &= values[i * static_cast<std::size_t>(spec.nchannels) +
                       static_cast<std::size_t>(channel)] == plane.values[i * names.size() + c];
      }
      CHECK(same);
      ++found;
    }
  }
  CHECK(static_cast<int>(found) == spec.nchannels);
}

TEST_CASE("Every AOV has a visualization that is not constant") {
  const TemporaryFolder folder;
  const pt::AovImage picture =
      render_aovs(floor_scene(folder), small_settings(kSize, 4), every_aov());
  for (const pt::AovInfo& aov : pt::all_aovs()) {
    CAPTURE(aov.name);
    const pt::Visualization view = pt::visualize(picture, aov.aov, {});
    const auto [least, most] =
        std::minmax_element(view.encoded.rgb.begin(), view.encoded.rgb.end());
    CHECK(view.encoded.rgb.size() == kSize * kSize * 3);
    CHECK(*least >= 0);
    CHECK(*most <= 1);
    CHECK(*most > *least + 0.1f);
  }
}

TEST_CASE("View transforms have their known values and are monotone") {
  using pt::ViewTransform;
  const auto shown = [](float light, ViewTransform transform, float exposure = 0) {
    return pt::to_display({1, 1, {light, light, light}}, {exposure, transform}).rgb;
  };
  CHECK(shown(0.5f, ViewTransform::srgb)[0] == Approx(0.735357f));
  CHECK(shown(0.25f, ViewTransform::srgb, 1) == shown(0.5f, ViewTransform::srgb));
  // Hable: white at 11.2 / 2, because the talk doubles the light first.
  CHECK(shown(5.6f, ViewTransform::filmic)[1] == Approx(1));
  CHECK(shown(1, ViewTransform::filmic)[1] == Approx(0.730674f).epsilon(1e-4));
  // Narkowicz: (2.51 + 0.03) / (2.43 + 0.59 + 0.14) = 0.80380.
  CHECK(shown(1, ViewTransform::aces)[2] == Approx(0.908230f).epsilon(1e-4));
  for (const auto& [name, transform] : pt::view_transforms()) {
    CAPTURE(name);
    if (transform == ViewTransform::false_color) continue;
    CHECK(shown(0, transform)[0] == Approx(0).margin(1e-6));
    float last = -1;
    for (float light = 0; light < 20; light = light * 1.3f + 0.001f) {
      CHECK(shown(light, transform)[0] >= last);
      last = shown(light, transform)[0];
    }
    CHECK(shown(std::numeric_limits<float>::quiet_NaN(), transform)[0] == Approx(0).margin(1e-6));
  }
  CHECK(shown(0.18f, ViewTransform::false_color) == std::vector<float>{0.2f, 0.75f, 0.3f});
  CHECK(shown(100, ViewTransform::false_color) == std::vector<float>{0.9f, 0.1f, 0.1f});
}
