// Colors of materials: images by UV, solid textures by position.
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "catch.hpp"
#include "plugins/pathtracer/materials/material_sample.h"
#include "plugins/pathtracer/materials/textures.h"
#include "plugins/pathtracer/reader/image_reader.h"
#include "plugins/pathtracer/scene/color.h"
#include "tests/scenes/support.h"

using namespace scene_tests;

namespace {

// The plane from -1 to 1 fills the image, seen from above, x to the right and z down, in an
// environment of radiance 1.
pt::Scene seen_from_above(const pt::Color& color) {
  pt::Material material;
  material.color = color;
  pt::Scene scene = make_scene(make_quad(1), material, {0, 10, 0}, 11.42f);
  scene.camera.up = {0, 0, -1};
  scene.environment = uniform_light(glm::vec3(1));
  return scene;
}

glm::vec3 pixel(const pt::Image& image, int x, int y) {
  const auto i = static_cast<std::size_t>(y * image.width + x) * 3;
  return {image.rgb[i], image.rgb[i + 1], image.rgb[i + 2]};
}

pt::ColorImage read_image(const std::filesystem::path& file, pt::ImageEncoding encoding) {
  std::vector<std::string> notes;
  const pt::ColorImage image = pt::read_image(file, encoding, pt::ImageRange::unit, notes);
  CHECK(notes.empty());
  return image;
}

bool near(const glm::vec3& a, const glm::vec3& b, float tolerance) {
  return glm::all(glm::lessThan(glm::abs(a - b), glm::vec3(tolerance)));
}

pt::Image four_colors() { return {2, 2, {1, 0, 0, 0, 1, 0, 0, 0, 1, 0.5f, 0.5f, 0.5f}}; }

// Decodes a color. Interpolation may overshoot the range 0 to 1.
glm::vec3 albedo_of(const glm::vec3& encoded) {
  const glm::vec3 albedo = pt::srgb_to_linear(glm::clamp(encoded, 0.0f, 1.0f));
  return glm::min(albedo, pt::kMaxTextureAlbedo);
}

}  // namespace

TEST_CASE("An image is mapped by UV, the first row on top") {
  const TemporaryFolder folder;
  pt::write_exr(four_colors(), folder / "colors.exr");
  pt::Scene scene = seen_from_above(pt::ImageColor{0});
  scene.images.push_back(read_image(folder / "colors.exr", pt::ImageEncoding::automatic));
  const pt::Image image = pt::render(scene, small_settings(32, 400));
  // The image's pixel centers are at a quarter and three quarters of the render.
  const int low = 8, high = 23;
  const bool passed = near(pixel(image, low, low), {0.999f, 0, 0}, 0.1f) &&
                      near(pixel(image, high, low), {0, 0.999f, 0}, 0.1f) &&
                      near(pixel(image, low, high), {0, 0, 0.999f}, 0.1f) &&
                      near(pixel(image, high, high), glm::vec3(0.5f), 0.1f);
  CHECK(save_unless(passed, image, "image-color"));
}

TEST_CASE("PNG files are sRGB, EXR files linear, in both directions") {
  const TemporaryFolder folder;
  pt::Image picture{3, 1, {0, 0.25f, 0.5f, 1, 0.02f, 0.003f, 0.7f, 0.18f, 1}};
  pt::write_png(pt::to_display(picture, {}), folder / "a.png");
  pt::write_exr(picture, folder / "a.exr");
  const auto from_png = read_image(folder / "a.png", pt::ImageEncoding::automatic);
  const auto from_exr = read_image(folder / "a.exr", pt::ImageEncoding::automatic);
  const auto undecoded = read_image(folder / "a.png", pt::ImageEncoding::linear);
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::vec3 expected(picture.rgb[3 * i], picture.rgb[3 * i + 1], picture.rgb[3 * i + 2]);
    CHECK(near(from_png.pixels[i], expected, 0.006f));
    CHECK(from_exr.pixels[i] == expected);
    CHECK(near(undecoded.pixels[i], pt::linear_to_srgb(expected), 0.003f));
  }
  // Exposure +1 stop, clamped.
  pt::write_png(pt::to_display(picture, {.exposure = 1}), folder / "b.png");
  const auto brighter = read_image(folder / "b.png", pt::ImageEncoding::automatic);
  CHECK(near(brighter.pixels[0], {0, 0.5f, 1}, 0.006f));
}

TEST_CASE("The sRGB curve has its known values and an inverse") {
  CHECK(pt::srgb_to_linear(glm::vec3(0.5f)).x == Approx(0.2140411f).epsilon(1e-4));
  CHECK(pt::linear_to_srgb(glm::vec3(0.18f)).x == Approx(0.4613561f).epsilon(1e-4));
  for (float x = 0; x <= 1; x += 0.01f) {
    CHECK(pt::srgb_to_linear(pt::linear_to_srgb(glm::vec3(x))).x == Approx(x).margin(1e-6));
  }
}

TEST_CASE("A solid color is the engine's value at the surface, decoded") {
  const TemporaryFolder folder;
  write_noise_model(folder / "noise.solidtex", 1);
  const solidtex::texture texture((folder / "noise.solidtex").string(), {.seed = 5});
  pt::Scene scene;
  scene.textures.emplace_back((folder / "noise.solidtex").string(), solidtex::options{.seed = 5});
  glm::dmat4 to_texels = glm::scale(glm::dmat4(1), glm::dvec3(7, 8, 9));
  to_texels[3] = {1000.5, -1e9, 3.25, 1};
  scene.materials.resize(3);
  scene.materials[0].color = pt::SolidColor{0, false, to_texels};
  scene.materials[1].color = pt::SolidColor{0, true, to_texels};
  scene.materials[2].color = glm::vec3(0.1f, 0.2f, 0.3f);

  std::vector<pt::SurfaceInteraction> interactions(90);
  for (std::size_t i = 0; i < interactions.size(); ++i) {
    const float t = static_cast<float>(i);
    interactions[i].object_position = {0.1f * t, 1 - 0.03f * t, 0.2f * t};
    interactions[i].position = interactions[i].object_position + glm::vec3(5, 6, 7);
    interactions[i].material = static_cast<std::uint32_t>(i % 3);
  }
  std::vector<pt::MaterialSample> found(interactions.size());
  pt::MaterialEvaluator lookup(scene, pt::TextureFilter::footprint);
  CHECK(lookup(interactions, found) == 60);

  for (std::size_t i = 0; i < interactions.size(); ++i) {
    if (i % 3 == 2) {
      CHECK(found[i].color == glm::vec3(0.1f, 0.2f, 0.3f));
      continue;
    }
    const glm::vec3 p = i % 3 == 0 ? interactions[i].object_position : interactions[i].position;
    const std::array<float, 3> texels = {7 * p.x, 8 * p.y, 9 * p.z};
    std::array<float, 3> value;
    texture.eval_points({1000.5, -1e9, 3.25}, texels, value);
    CAPTURE(i);
    CHECK(near(found[i].color, albedo_of({value[0], value[1], value[2]}), 2e-5f));
  }
}

TEST_CASE("Color and roughness channels are found by name, in any order") {
  const TemporaryFolder folder;
  const std::vector<std::string> names = {"height",   "albedo.b",  "roughness",
                                          "albedo.r", "metalness", "albedo.g"};
  write_noise_model(folder / "maps.solidtex", 0, names);
  const solidtex::texture texture((folder / "maps.solidtex").string());
  pt::Scene scene;
  scene.textures.emplace_back((folder / "maps.solidtex").string());
  scene.materials.resize(2);
  for (pt::Material& material : scene.materials) {
    material.type = pt::MaterialType::coated;
    material.color = pt::SolidColor{0, false, glm::dmat4(1)};
    material.roughness = 0.7f;
  }
  scene.materials[1].roughness =
      pt::SolidChannel{pt::channel_index(scene.textures[0], "roughness")};

  std::vector<pt::SurfaceInteraction> interactions(40);
  for (std::size_t i = 0; i < interactions.size(); ++i) {
    interactions[i].object_position = glm::vec3(0.37f, 0.71f, 1.1f) * static_cast<float>(i);
    interactions[i].material = i % 2;
  }
  std::vector<pt::MaterialSample> found(interactions.size());
  pt::MaterialEvaluator lookup(scene, pt::TextureFilter::footprint);
  CHECK(lookup(interactions, found) == 40);
  for (std::size_t i = 0; i < interactions.size(); ++i) {
    const glm::vec3& p = interactions[i].object_position;
    const std::array<float, 3> point = {p.x, p.y, p.z};
    std::array<float, 6> value;
    texture.eval_points({0, 0, 0}, point, value);
    CAPTURE(i);
    CHECK(near(found[i].color, albedo_of({value[3], value[5], value[1]}), 2e-5f));
    CHECK(found[i].roughness == (i % 2 ? value[2] : 0.7f));
  }
}

TEST_CASE("Roughness may be a channel of the color's solid texture") {
  const TemporaryFolder folder;
  write_noise_model(folder / "maps.solidtex", 3,
                    {"roughness", "albedo.r", "albedo.g", "albedo.b", "height"});
  write_ply(folder / "quad.ply", make_quad(1));
  nlohmann::json scene = nlohmann::json::parse(R"({
    "version": 1,
    "camera": {"position": [0, 3, 1], "look_at": [0, 0, 0], "fov": 30},
    "materials": {"metal": {"type": "coated", "roughness": {"channel": "roughness"},
                            "color": {"solid": "maps.solidtex", "texels_per_unit": 20}}},
    "objects": [{"mesh": "quad.ply", "material": "metal"}],
    "lights": [{"position": [0, 3, -1], "look_at": [0, 0, 0], "size": [1, 1],
                "radiance": [40, 40, 40]}]
  })");
  const auto render = [&] {
    write_text(folder / "scene.json", scene.dump());
    return pt::render(*pt::load_scene(folder / "scene.json"), small_settings(24, 16));
  };
  const pt::Image varied = render();
  scene["materials"]["metal"]["roughness"] = 0.5;
  const pt::Image even = render();
  float difference = 0;
  for (std::size_t i = 0; i < varied.rgb.size(); ++i) {
    REQUIRE(std::isfinite(varied.rgb[i]));
    difference = std::max(difference, std::abs(varied.rgb[i] - even.rgb[i]));
  }
  CAPTURE(difference);
  CHECK(save_unless(difference > 0.1f, varied, "roughness-channel"));
}

TEST_CASE("A rendered solid color is the engine's voxel, in object or world space") {
  const TemporaryFolder folder;
  write_noise_model(folder / "noise.solidtex", 6);
  const solidtex::texture texture((folder / "noise.solidtex").string());
  std::array<float, 3> value;
  texture.eval_box({10, 10, 10}, {1, 1, 1}, value);
  const glm::vec3 expected = pt::srgb_to_linear({value[0], value[1], value[2]});

  // The whole plane lies in one cell of constant color.
  glm::dmat4 to_texels = glm::scale(glm::dmat4(1), glm::dvec3(8));
  to_texels[3] = {32, 32, 32, 1};
  for (const bool world_space : {false, true}) {
    pt::Scene scene = seen_from_above(pt::SolidColor{0, world_space, to_texels});
    scene.textures.emplace_back((folder / "noise.solidtex").string());
    const pt::Image still = pt::render(scene, small_settings(16, 256));
    CHECK(save_unless(near(middle_color(still, 4), expected, 0.01f), still, "solid-color"));

    // Moves by 20 units along y: object space keeps its color, world space reaches another cell.
    scene.objects[0].to_world[3] = {0, -20, 0, 1};
    scene.camera.position.y -= 20;
    scene.camera.look_at.y -= 20;
    const pt::Image moved = pt::render(scene, small_settings(16, 256));
    const bool same = near(middle_color(moved, 4), expected, 0.01f);
    CHECK(save_unless(same == !world_space, moved, "solid-color-moved"));
  }
}

namespace {

// A plane under a constant sky. A pixel covers two texels and more.
pt::Image render_plane(const std::filesystem::path& model, pt::TextureFilter filter, int samples) {
  pt::Scene scene = make_scene(make_quad(200), {}, {0, 2, 6}, 24);  // just below the horizon
  scene.textures.emplace_back(model.string());
  scene.materials[0].color = pt::SolidColor{0, false, glm::scale(glm::dmat4(1), glm::dvec3(50))};
  scene.environment = uniform_light(glm::vec3(1));
  pt::RenderSettings settings = small_settings(40, samples);
  settings.max_depth = 2;
  settings.light_sampling = pt::LightSampling::bsdf;
  settings.texture_filter = filter;
  return pt::render(scene, settings);
}

double rms_difference(const pt::Image& a, const pt::Image& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) sum += std::pow(a.rgb[i] - b.rgb[i], 2);
  return std::sqrt(sum / static_cast<double>(a.rgb.size()));
}

}  // namespace

TEST_CASE("A plane to the horizon does not alias") {
  const TemporaryFolder folder;
  write_noise_model(folder / "noise.solidtex", 0);
  const auto render = [&](pt::TextureFilter filter, int samples) {
    return render_plane(folder / "noise.solidtex", filter, samples);
  };
  const pt::Image reference = render(pt::TextureFilter::none, 400);
  const double plain = rms_difference(render(pt::TextureFilter::none, 1), reference);
  const double stochastic = rms_difference(render(pt::TextureFilter::stochastic, 1), reference);
  const double filtered = rms_difference(render(pt::TextureFilter::footprint, 1), reference);
  const double four = rms_difference(render(pt::TextureFilter::footprint, 4), reference);
  const double slanted = rms_difference(render(pt::TextureFilter::anisotropic, 1), reference);
  CAPTURE(plain, stochastic, filtered, slanted, four);
  CHECK(slanted < 0.95 * filtered);
  CHECK(filtered < 0.3 * plain);
  CHECK(four < 1.1 * filtered);  // the rest is bias, not noise
  CHECK(stochastic < 1.3 * plain);
  // With many samples footprints shrink to points.
  const pt::Image many = render(pt::TextureFilter::footprint, 400);
  CHECK(rms_difference(many, reference) < 0.15 * plain);
}

TEST_CASE("Footprints are in texels, independent of the object's scale") {
  const TemporaryFolder folder;
  write_noise_model(folder / "noise.solidtex", 0);
  const auto render = [&](pt::TextureFilter filter, float scale, bool world) {
    pt::Scene scene = make_scene(make_quad(1 / scale), {}, {0, 3, 0.1f}, 30);
    scene.textures.emplace_back((folder / "noise.solidtex").string());
    scene.objects[0].to_world = glm::scale(glm::mat4(1), glm::vec3(scale));
    const double texels = world ? 100 : 100 * scale;
    pt::SolidColor color;
    color.world_space = world;
    color.to_texels = glm::scale(glm::dmat4(1), glm::dvec3(texels));
    scene.materials[0].color = color;
    scene.environment = uniform_light(glm::vec3(1));
    pt::RenderSettings settings = small_settings(16, 1);
    settings.max_depth = 2;
    settings.light_sampling = pt::LightSampling::bsdf;
    settings.texture_filter = filter;
    return pt::render(scene, settings);
  };
  for (const auto filter : {pt::TextureFilter::footprint, pt::TextureFilter::anisotropic}) {
    const pt::Image expected = render(filter, 1, false);
    CHECK(rms_difference(expected, render(filter, 4, false)) < 1e-4);
    CHECK(rms_difference(expected, render(filter, 4, true)) < 1e-4);
  }
}
