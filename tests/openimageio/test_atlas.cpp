// A mesh's UV atlas as a 2D image with a mipmap: the values of mesh::Atlas, whoever asks how.
#include <OpenImageIO/imagecache.h>
#include <OpenImageIO/texture.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <thread>

#include "catch.hpp"
#include "plugins/mesh/atlas.h"
#include "tests/openimageio/support.h"

using namespace openimageio_tests;
namespace fs = std::filesystem;

namespace {

// A bent sheet: two quadrilaterals of different sizes, a chart each.
constexpr char kSheet[] =
    "v 0 0 0\nv 3 0 0\nv 3 1 0\nv 0 1 0\nv 3 0 2\nv 0 0 2\n"
    "vt 0.1 0.5\nvt 0.9 0.5\nvt 0.9 0.9\nvt 0.1 0.9\n"
    "vt 0.1 0.1\nvt 0.7 0.1\nvt 0.7 0.4\nvt 0.1 0.4\n"
    "f 1/1 2/2 3/3 4/4\nf 1/5 6/6 5/7 2/8\n";
constexpr char kNoUvs[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
constexpr int kSize = 150;

struct Files {
  Files() : folder(fs::temp_directory_path() / ("solidtex-atlas-" + std::to_string(getpid()))) {
    fs::create_directories(folder);
    std::ofstream(folder / "sheet.obj") << kSheet;
    std::ofstream(folder / "bare.obj") << kNoUvs;
    std::ofstream(folder / "broken.ply") << "ply\nformat ascii 1.0\n";
  }
  ~Files() { fs::remove_all(folder); }
  std::string operator/(const char* name) const { return (folder / name).string(); }
  fs::path folder;
};

std::string atlas_name(const Files& files) {
  return tiny_lattice() + "?mesh=" + (files / "sheet.obj") +
         "&size=150&scale=9&origin=5,-6,7&seed=3&type=float";
}

// [y][x][channel] of the level of the mipmap whose edge this is.
std::vector<float> expected(const Files& files, int size) {
  const solidtex::texture texture(tiny_lattice(), {.seed = 3});
  const auto mesh =
      std::make_shared<const solidtex::mesh::Mesh>(solidtex::mesh::load_mesh(files / "sheet.obj"));
  const solidtex::mesh::Atlas atlas(mesh, {{5, -6, 7}, 9}, size);
  std::vector<float> values(static_cast<std::size_t>(size * size) * texture.channel_count());
  atlas.evaluate(texture, {{0, 0}, {size, size}}, values.data());
  return values;
}

}  // namespace

TEST_CASE("An atlas is a flat image with a mipmap, each level with its own values") {
  const Files files;
  const auto input = open_image(atlas_name(files));
  int level = 0;
  for (int size = kSize; size > 0; size /= 2, ++level) {
    const OIIO::ImageSpec spec = input->spec(0, level);
    CHECK((spec.width == size && spec.height == size && spec.depth == 1));
    CHECK((spec.tile_width == 64 && spec.tile_height == 64 && spec.tile_depth == 1));
    CHECK(spec.get_string_attribute("wrapmodes") == "clamp,clamp");
    CHECK(spec.find_attribute("worldtolocal") == nullptr);
    std::vector<float> found(static_cast<std::size_t>(size * size * spec.nchannels));
    REQUIRE(input->read_image(0, level, 0, spec.nchannels, OIIO::TypeFloat, found.data()));
    const std::vector<float> wanted = expected(files, size);
    CHECK(std::memcmp(found.data(), wanted.data(), wanted.size() * sizeof(float)) == 0);
    CHECK(*std::max_element(found.begin(), found.end()) > 0.01f);
  }
  CHECK_FALSE(input->seek_subimage(0, level));
  CHECK_FALSE(input->seek_subimage(1, 0));
  CHECK(input->spec(1, 0).width == 0);
}

TEST_CASE("Tiles of an atlas from many threads through a small cache have its values") {
  const Files files;
  register_plugin();
  auto* cache = OIIO::ImageCache::create(false);
  cache->attribute("max_memory_MB", 0.1f);
  const OIIO::ustring name(atlas_name(files));
  const std::vector<float> wanted = expected(files, kSize);
  std::atomic<int> wrong = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; i < 400; ++i) {
        const int x = (i * 37 + t * 11) % kSize, y = (i * 53 + t * 29) % kSize;
        float pixel[2] = {};
        const bool there =
            cache->get_pixels(name, 0, 0, x, x + 1, y, y + 1, 0, 1, 0, 2, OIIO::TypeFloat, pixel);
        const float* should = &wanted[2 * static_cast<std::size_t>(y * kSize + x)];
        if (!there || pixel[0] != should[0] || pixel[1] != should[1]) ++wrong;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  CHECK(wrong == 0);
  OIIO::ImageCache::destroy(cache);
}

TEST_CASE("texture() looks an atlas up by s and t, and filters by the mipmap") {
  const Files files;
  register_plugin();
  auto* textures = OIIO::TextureSystem::create(false);
  const OIIO::ustring name(atlas_name(files));
  OIIO::TextureOpt options;
  options.interpmode = OIIO::TextureOpt::InterpClosest;
  options.mipmode = OIIO::TextureOpt::MipModeNoMIP;
  float found[2];
  const int x = 70, y = 40;  // t runs down
  REQUIRE(textures->texture(name, options, (x + 0.5f) / kSize, (y + 0.5f) / kSize, 0, 0, 0, 0, 2,
                            found));
  const std::vector<float> sharp = expected(files, kSize);
  CHECK(found[0] == sharp[2 * static_cast<std::size_t>(y * kSize + x)]);

  options = {};
  options.mipmode = OIIO::TextureOpt::MipModeOneLevel;
  options.interpmode = OIIO::TextureOpt::InterpClosest;
  const float wide = 1.0f / 18;  // level 3 has 18 texels
  REQUIRE(textures->texture(name, options, 8.5f / 18, 5.5f / 18, wide, 0, 0, wide, 2, found));
  const std::vector<float> blurred = expected(files, 18);
  CHECK(found[0] == blurred[2 * static_cast<std::size_t>(5 * 18 + 8)]);
  OIIO::TextureSystem::destroy(textures, true);  // with its cache, which version 2.4 leaves
}

TEST_CASE("Hostile queries for an atlas are refused with a message") {
  const Files files;
  const std::string mesh = "mesh=" + (files / "sheet.obj");
  const std::pair<std::string, std::string> cases[] = {
      {"mesh=", "mesh is \"\", expected an OBJ or PLY file"},
      {"mesh=a\nb.obj", "mesh is \"a?b.obj\""},
      {"mesh=" + (files / "none.obj"), "none.obj: found no such file"},
      {"mesh=" + files.folder.string(), "found a folder, expected a mesh"},
      {"mesh=/etc/passwd", "found a file named *, expected *.ply, *.obj, "},
      {"mesh=" + (files / "broken.ply"), "broken.ply: found a header without an end"},
      {"mesh=" + (files / "bare.obj"), "found no texture coordinates"},
      {mesh + "&" + mesh, "mesh twice"},
      {mesh + "&size=64x64x1", "size is \"64x64x1\""},
      {mesh + "&size=16385", "one number up to 16384"},
      {"size=16385&" + mesh, "one number up to 16384"},
      {mesh + "&lod=1", "lod is \"1\", expected none"},
      {mesh + "&scale=nan", "scale is \"nan\""},
      {mesh + "&tile=3", "tile is \"3\""},
  };
  for (const auto& [query, words] : cases) {
    CAPTURE(query);
    const std::string message = refusal(tiny_lattice() + "?" + query);
    CAPTURE(message);
    CHECK(message.find(words) != std::string::npos);
  }
}
