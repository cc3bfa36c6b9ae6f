// Image files as people have them: parts, layers, data windows, values out of range.
#include <OpenImageIO/imageio.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>

#include "catch.hpp"
#include "plugins/pathtracer/reader/image_reader.h"
#include "plugins/pathtracer/scene/color.h"
#include "tests/scenes/support.h"

using namespace scene_tests;
namespace fs = std::filesystem;

namespace {

// One part of a file: a spec and a function of the channel that fills it.
struct Part {
  OIIO::ImageSpec spec;
  std::vector<float> values;  // per channel, equal in all pixels
};

Part make_part(const std::vector<std::string>& channels, const std::vector<float>& values,
               OIIO::TypeDesc type = OIIO::TypeDesc::FLOAT, const std::string& name = "") {
  Part part{OIIO::ImageSpec(4, 3, static_cast<int>(channels.size()), type), values};
  part.spec.channelnames = channels;
  if (!name.empty()) part.spec.attribute("oiio:subimagename", name);
  return part;
}

std::vector<float> pixels_of(const Part& part) {
  std::vector<float> pixels;
  for (OIIO::imagesize_t i = 0; i < part.spec.image_pixels(); ++i) {
    pixels.insert(pixels.end(), part.values.begin(), part.values.end());
  }
  return pixels;
}

void write_pixels(const fs::path& file, const OIIO::ImageSpec& spec,
                  const std::vector<float>& pixels) {
  const auto output = OIIO::ImageOutput::create(file.string());
  REQUIRE(output);
  REQUIRE(output->open(file.string(), spec));
  REQUIRE(output->write_image(OIIO::TypeDesc::FLOAT, pixels.data()));
  REQUIRE(output->close());
}

void write_part(const fs::path& file, const Part& part) {
  write_pixels(file, part.spec, pixels_of(part));
}

void write_parts(const fs::path& file, const std::vector<Part>& parts) {
  std::vector<OIIO::ImageSpec> specs;
  for (const Part& part : parts) specs.push_back(part.spec);
  const auto output = OIIO::ImageOutput::create(file.string());
  REQUIRE(output);
  REQUIRE(output->open(file.string(), static_cast<int>(specs.size()), specs.data()));
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (i > 0) REQUIRE(output->open(file.string(), specs[i], OIIO::ImageOutput::AppendSubimage));
    REQUIRE(output->write_image(OIIO::TypeDesc::FLOAT, pixels_of(parts[i]).data()));
  }
  REQUIRE(output->close());
}

struct Loaded {
  pt::ColorImage image;
  std::string notes;
};

Loaded load(const fs::path& file, pt::ImageRange range = pt::ImageRange::radiance,
            pt::ImageEncoding encoding = pt::ImageEncoding::automatic) {
  std::vector<std::string> notes;
  Loaded loaded{pt::read_image(file, encoding, range, notes), ""};
  for (const std::string& note : notes) loaded.notes += note + "\n";
  return loaded;
}

std::string refusal(const fs::path& file, pt::ImageRange range = pt::ImageRange::radiance) {
  try {
    load(file, range);
  } catch (const pt::SceneError& error) {
    CHECK_THAT(error.what(), ContainsSubstring(file.string()));
    return error.what();
  }
  return "not refused";
}

const std::vector<std::string> kRgb = {"R", "G", "B"};
const glm::vec3 kColor(0.25f, 0.5f, 0.75f);

}  // namespace

TEST_CASE("An EXR with several parts gives the part with the color") {
  const TemporaryFolder folder;
  const Part depth = make_part({"Z"}, {7}, OIIO::TypeDesc::FLOAT, "depth");
  const Part color = make_part(kRgb, {0.25f, 0.5f, 0.75f}, OIIO::TypeDesc::HALF, "rgb");
  const Part normal = make_part(kRgb, {0, 1, 0}, OIIO::TypeDesc::FLOAT, "normal");
  write_parts(folder / "a.exr", {depth, color, normal});
  const Loaded loaded = load(folder / "a.exr");
  CHECK(loaded.image.pixels[5] == kColor);
  CHECK_THAT(loaded.notes,
             ContainsSubstring("a.exr: the color is the layer rgb of depth, rgb, normal"));

  write_parts(folder / "data.exr", {depth, normal});
  CHECK_THAT(refusal(folder / "data.exr"),
             ContainsSubstring("found the layers depth, normal, expected"));
  Part left = color, right = color;
  left.spec.attribute("oiio:subimagename", "left");
  right.spec.attribute("oiio:subimagename", "right");
  write_parts(folder / "stereo.exr", {left, right});
  CHECK_THAT(refusal(folder / "stereo.exr"),
             ContainsSubstring("found the layers left, right, expected"));
}

TEST_CASE("An EXR with several layers gives the layer with the color") {
  const TemporaryFolder folder;
  const auto color_of = [&](const std::vector<std::string>& channels,
                            const std::vector<float>& values) {
    write_part(folder / "a.exr", make_part(channels, values));
    return load(folder / "a.exr").image.pixels[0];
  };
  // The file stores channels by name: AO comes first.
  CHECK(color_of({"AO.R", "AO.G", "AO.B", "Combined.R", "Combined.G", "Combined.B"},
                 {1, 1, 1, 0.25f, 0.5f, 0.75f}) == kColor);
  CHECK(color_of({"View Layer.Combined.R", "View Layer.Combined.G", "View Layer.Combined.B",
                  "View Layer.Combined.A", "View Layer.Depth.Z"},
                 {0.25f, 0.5f, 0.75f, 1, 9}) == kColor);
  CHECK(color_of({"Beauty.R", "Beauty.G", "Beauty.B"}, {0.25f, 0.5f, 0.75f}) == kColor);
  CHECK(color_of({"sky.red", "sky.green", "sky.blue", "AO.R", "AO.G", "AO.B"},
                 {0.25f, 0.5f, 0.75f, 1, 1, 1}) == kColor);
  // Plain channels come before any layer, as in the files of solidtex-render --aovs.
  CHECK(color_of(
            {"R", "G", "B", "Beauty.R", "Beauty.G", "Beauty.B", "albedo.R", "albedo.G", "albedo.B"},
            {0.25f, 0.5f, 0.75f, 1, 1, 1, 0, 0, 0}) == kColor);
  CHECK(load(folder / "a.exr").notes.empty());
  CHECK(color_of({"Y", "Z"}, {0.5f, 9}) == glm::vec3(0.5f));
}

TEST_CASE("An EXR without one color layer is refused, listing the layers") {
  const TemporaryFolder folder;
  const auto refuse = [&](const std::vector<std::string>& channels) {
    write_part(folder / "a.exr", make_part(channels, std::vector<float>(channels.size(), 1)));
    return refusal(folder / "a.exr");
  };
  CHECK_THAT(refuse({"AO.R", "AO.G", "AO.B", "N.X", "N.Y", "N.Z"}),
             ContainsSubstring("found the layers AO, N, expected"));
  CHECK_THAT(refuse({"key.R", "key.G", "key.B", "fill.R", "fill.G", "fill.B"}),
             ContainsSubstring("found the layers fill, key, expected"));
  CHECK_THAT(refuse({"Z"}), ContainsSubstring("found the channels Z, expected R, G, B or Y"));
}

TEST_CASE("An EXR fills its display window") {
  const TemporaryFolder folder;
  Part part = make_part(kRgb, {0.25f, 0.5f, 0.75f});
  const auto load_window = [&](int x, int y, int full_width, int full_height) {
    part.spec.x = x, part.spec.y = y;
    part.spec.full_width = full_width, part.spec.full_height = full_height;
    write_part(folder / "a.exr", part);
    return load(folder / "a.exr");
  };
  const Loaded inside = load_window(1, 2, 8, 6);
  CHECK(inside.image.width == 8);
  CHECK(inside.image.height == 6);
  for (int y = 0; y < 6; ++y) {
    for (int x = 0; x < 8; ++x) {
      const bool has_data = x >= 1 && x < 5 && y >= 2 && y < 5;
      CHECK(inside.image.at(x, y) == (has_data ? kColor : glm::vec3(0)));
    }
  }
  CHECK_THAT(inside.notes, ContainsSubstring("the data window covers 4 x 3 of 8 x 6 pixels"));

  const Loaded overscan = load_window(-1, -1, 2, 1);
  CHECK(overscan.image.width == 2);
  CHECK(overscan.image.height == 1);
  CHECK(overscan.image.pixels == std::vector<glm::vec3>{kColor, kColor});
  CHECK(overscan.notes.empty());

  part.spec.x = 20;
  write_part(folder / "a.exr", part);
  CHECK_THAT(refusal(folder / "a.exr"),
             ContainsSubstring("a data window outside the display window"));
}

TEST_CASE("Small negative values are clamped with a note, others refused") {
  const TemporaryFolder folder;
  write_part(folder / "a.exr", make_part(kRgb, {2, -0.01f, 1}));
  const Loaded loaded = load(folder / "a.exr");
  CHECK(loaded.image.pixels[0] == glm::vec3(2, 0, 1));
  CHECK_THAT(loaded.notes,
             ContainsSubstring("12 values below 0, the smallest -0.01, are clamped to 0"));
  write_part(folder / "b.exr", make_part(kRgb, {0.5f, -0.5f, 1}));
  CHECK_THAT(refusal(folder / "b.exr"), ContainsSubstring("the value -0.5 in pixel (0, 0)"));
}

TEST_CASE("Values that are not finite are refused with their pixel") {
  const TemporaryFolder folder;
  for (const float value :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    const Part part = make_part(kRgb, {0.25f, 0.5f, 0.75f});
    std::vector<float> pixels = pixels_of(part);
    pixels[3 * (4 * 1 + 2) + 1] = value;  // x = 2, y = 1
    write_pixels(folder / "a.exr", part.spec, pixels);
    CHECK_THAT(refusal(folder / "a.exr"),
               ContainsSubstring("in pixel (2, 1), expected finite values"));
  }
}

TEST_CASE("Truncated images, other color models and other contents are refused") {
  const TemporaryFolder folder;
  const auto content_of = [](const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  };
  const auto write = [&](const std::string& name, const std::string& content) {
    std::ofstream(folder / name, std::ios::binary) << content;
    return folder / name;
  };
  Part part = make_part(kRgb, {0.2f, 0.4f, 0.6f}, OIIO::TypeDesc::UINT8);
  part.spec.width = part.spec.full_width = 64, part.spec.height = part.spec.full_height = 64;
  for (const std::string name : {"a.jpg", "a.png", "a.tif", "a.exr", "a.hdr", "a.tga"}) {
    CAPTURE(name);
    write_part(folder / name, part);
    const std::string whole = content_of(folder / name);
    CHECK_THAT(refusal(write(name, whole.substr(0, whole.size() * 2 / 3))),
               ContainsSubstring("expected"));
  }
  CHECK_THAT(refusal(write("a.png", "")), ContainsSubstring("an empty file"));
  CHECK_THAT(refusal(write("a.exr", "<!DOCTYPE html>")), ContainsSubstring("an HTML page"));
  CHECK_THAT(refusal(write("a.hdr", "version https://git-lfs.github.com/spec/v1\n")),
             ContainsSubstring("run git lfs pull"));
  std::filesystem::create_directory(folder / "b.png");
  CHECK_THAT(refusal(folder / "b.png"), ContainsSubstring("a folder"));
  part.spec.attribute("Orientation", 6);
  write_part(folder / "turned.jpg", part);
  CHECK_THAT(load(folder / "turned.jpg").notes, ContainsSubstring("not turned (orientation 6)"));
}

TEST_CASE("An image is known by its first bytes, whatever its name ends in") {
  const TemporaryFolder folder;
  const Part part = make_part(kRgb, {0.2f, 0.4f, 0.6f}, OIIO::TypeDesc::UINT8);
  const glm::vec3 color = pt::srgb_to_linear(glm::vec3(0.2f, 0.4f, 0.6f));
  for (const std::string ending : {"png", "tif", "bmp", "ppm", "jpg"}) {
    CAPTURE(ending);
    write_part(folder / ("a." + ending), part);
    for (const std::string name : {"photo", "photo.jpeg", "photo.psd"}) {
      fs::rename(folder / ("a." + ending), folder / name);
      CHECK(glm::length(load(folder / name).image.pixels[0] - color) < 0.01f);
      fs::rename(folder / name, folder / ("a." + ending));
    }
  }
  write_part(folder / "a.tga", part);  // which has no beginning of its own
  CHECK(glm::length(load(folder / "a.tga").image.pixels[0] - color) < 0.01f);
  write_part(folder / "a.sgi", part);
  CHECK_THAT(refusal(folder / "a.sgi"), ContainsSubstring("it begins like none of PNG, JPEG"));
}

TEST_CASE("Gray and 16-bit images, alpha, palettes and extensions in capitals are read") {
  const TemporaryFolder folder;
  const auto check = [&](const std::string& name, const Part& part, const glm::vec3& encoded,
                         const std::string& note) {
    CAPTURE(name);
    write_part(folder / name, part);
    const Loaded loaded = load(folder / name, pt::ImageRange::unit);
    const glm::vec3 difference = loaded.image.pixels[0] - pt::srgb_to_linear(encoded);
    CHECK(glm::length(difference) < 0.01f);
    if (note.empty()) CHECK(loaded.notes == "");
    CHECK_THAT(loaded.notes, ContainsSubstring(note));
  };
  const auto u8 = OIIO::TypeDesc::UINT8, u16 = OIIO::TypeDesc::UINT16;
  check("gray.png", make_part({"Y"}, {0.4f}, u8), glm::vec3(0.4f), "");
  check("grey-alpha.png", make_part({"Y", "A"}, {0.4f, 1}, u8), glm::vec3(0.4f), "");
  check("gray.tif", make_part({"Y"}, {0.4f}, u16), glm::vec3(0.4f), "");
  check("color16.PNG", make_part(kRgb, {0.2f, 0.4f, 0.6f}, u16), {0.2f, 0.4f, 0.6f}, "");
  check("color.TIF", make_part(kRgb, {0.2f, 0.4f, 0.6f}, u8), {0.2f, 0.4f, 0.6f}, "");
  check("color.JPG", make_part(kRgb, {0.2f, 0.4f, 0.6f}, u8), {0.2f, 0.4f, 0.6f}, "");
  check("palette.gif", make_part(kRgb, {0.2f, 0.4f, 0.6f}, u8), {0.2f, 0.4f, 0.6f}, "");
  // Colors are as stored, not multiplied by alpha.
  Part transparent = make_part({"R", "G", "B", "A"}, {0.2f, 0.4f, 0.6f, 0.5f}, u8);
  transparent.spec.attribute("oiio:UnassociatedAlpha", 1);
  check("alpha.png", transparent, {0.2f, 0.4f, 0.6f}, "alpha.png: alpha is ignored");

  write_part(folder / "linear.EXR", make_part(kRgb, {0.25f, 0.5f, 0.75f}));
  CHECK(load(folder / "linear.EXR").image.pixels[0] == kColor);
}

TEST_CASE("Float images of materials are scaled to the range 0 to 1, or refused") {
  const TemporaryFolder folder;
  write_part(folder / "a.tif", make_part(kRgb, {51, 102, 255}));
  const Loaded scaled = load(folder / "a.tif", pt::ImageRange::unit);
  CHECK(glm::length(scaled.image.pixels[0] - pt::srgb_to_linear({0.2f, 0.4f, 1})) < 1e-5f);
  CHECK_THAT(scaled.notes,
             ContainsSubstring("whole numbers up to 255, stored as floats, are divided by"));
  const Loaded numbers = load(folder / "a.tif", pt::ImageRange::unit, pt::ImageEncoding::linear);
  CHECK(glm::length(numbers.image.pixels[0] - glm::vec3(0.2f, 0.4f, 1)) < 1e-5f);
  CHECK(load(folder / "a.tif").image.pixels[0] == glm::vec3(51, 102, 255));  // radiance

  write_part(folder / "b.tif", make_part(kRgb, {51.5f, 102, 0.5f}));
  CHECK_THAT(refusal(folder / "b.tif", pt::ImageRange::unit),
             ContainsSubstring(
                 "float values up to 102, 67 % of them above 1, expected values from 0 to 1"));
  write_part(folder / "c.tif", make_part(kRgb, {1.5f, 0.5f, 0.5f}));
  CHECK_THAT(load(folder / "c.tif", pt::ImageRange::unit).notes,
             ContainsSubstring("33 % of the values"));
}

TEST_CASE("Integers that use a small part of their range get a note") {
  const TemporaryFolder folder;
  const float twelve_bits = 4095.0f / 65535;
  write_part(folder / "a.tif",
             make_part(kRgb, std::vector<float>(3, twelve_bits), OIIO::TypeDesc::UINT16));
  CHECK_THAT(load(folder / "a.tif", pt::ImageRange::unit).notes,
             ContainsSubstring("the largest value is 4095 of 65535, nearly black"));
}

namespace {

// A gray TIFF of one pixel, whose white is zero, with an 8- or 16-bit value.
template <class Value>
void write_white_is_zero(const fs::path& file, Value value) {
  constexpr std::uint16_t kShort = 3;
  constexpr std::uint32_t kStrip = 8 + 2 + 8 * 12 + 4;  // after header and directory
  const std::array<std::uint32_t, 2> tags[] = {
      {256, 1},      {257, 1}, {258, 8 * sizeof(Value)}, {259, 1}, {262, 0},
      {273, kStrip}, {278, 1}, {279, sizeof(Value)}};
  std::string bytes("II*\0\10\0\0\0\10\0", 10);
  const auto append = [&](const auto& number) {
    bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
  };
  for (const auto& [tag, content] : tags) {
    append(static_cast<std::uint16_t>(tag));
    append(kShort);
    append(std::uint32_t{1});
    append(content);
  }
  append(std::uint32_t{0});
  append(value);
  write_text(file, bytes);
}

}  // namespace

TEST_CASE("A TIFF whose white is zero is inverted at any depth") {
  const TemporaryFolder folder;
  write_white_is_zero(folder / "8.tif", std::uint8_t{51});
  write_white_is_zero(folder / "16.tif", std::uint16_t{51 * 257});
  for (const std::string name : {"8.tif", "16.tif"}) {
    const Loaded loaded = load(folder / name, pt::ImageRange::unit, pt::ImageEncoding::linear);
    CHECK(loaded.image.pixels[0].x == Approx(0.8));
  }
}

TEST_CASE("Of several pages the largest is read") {
  const TemporaryFolder folder;
  Part thumbnail = make_part(kRgb, {0, 0, 0}, OIIO::TypeDesc::UINT8);
  Part image = make_part(kRgb, {1, 1, 1}, OIIO::TypeDesc::UINT8);
  image.spec.width = image.spec.full_width = 9;
  write_parts(folder / "a.tif", {thumbnail, image});
  const Loaded loaded = load(folder / "a.tif");
  CHECK(loaded.image.width == 9);
  CHECK(loaded.image.pixels[0] == glm::vec3(1));
  CHECK_THAT(loaded.notes, ContainsSubstring("the color is page 2 of 2"));
}

TEST_CASE("An environment's layer is chosen and noted") {
  const TemporaryFolder folder;
  write_part(folder / "sky.exr",
             make_part({"AO.R", "AO.G", "AO.B", "Combined.R", "Combined.G", "Combined.B"},
                       {0, 0, 0, 0.25f, 0.5f, 0.75f}));
  write_text(folder / "scene.json", R"({
    "version": 1,
    "camera": {"position": [0, 0, 1], "look_at": [0, 0, 0], "fov": 40},
    "materials": {"gray": {"type": "diffuse", "color": [0.5, 0.5, 0.5]}},
    "objects": [],
    "environment": {"file": "sky.exr"}
  })");
  const auto scene = pt::load_scene(folder / "scene.json");
  CHECK(mean_color(pt::render(*scene, small_settings(4, 1))) == kColor);
  const std::vector<std::string> notes = pt::notes_of(*scene);
  REQUIRE(notes.size() == 1);
  CHECK(notes[0] == "sky.exr: the color is the layer Combined of AO, Combined");
}
