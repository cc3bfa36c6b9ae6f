// ImageCache and TextureSystem: what a renderer asks, from several threads and with little memory.
#include <OpenImageIO/Imath.h>
#include <OpenImageIO/imagecache.h>
#include <OpenImageIO/texture.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <thread>

#include "catch.hpp"
#include "tests/openimageio/support.h"

using namespace openimageio_tests;

namespace {

constexpr int kEdge = 96;  // texels

// With its cache, which version 2.4 leaves.
struct SystemCloser {
  void operator()(OIIO::TextureSystem* system) const { OIIO::TextureSystem::destroy(system, true); }
};
using System = std::unique_ptr<OIIO::TextureSystem, SystemCloser>;

// Its own cache, of one megabyte.
System small_system() {
  register_plugin();
  System system(OIIO::TextureSystem::create(false));
  system->attribute("max_memory_MB", 1.0f);
  return system;
}

// Points of the world between the outermost voxel centers, for images with two texels a unit.
std::vector<Imath::V3f> random_points(unsigned seed, int count) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<float> texel(0.5f, kEdge - 0.5f);
  std::vector<Imath::V3f> points;
  for (int i = 0; i < count; ++i) {
    points.emplace_back(texel(generator) / 2, texel(generator) / 2, texel(generator) / 2);
  }
  return points;
}

// A value between voxel centers, and how much it may change over the rounding of a coordinate.
struct Reference {
  double value, bound;
};

std::vector<Reference> trilinear(const solidtex::texture& texture, const Imath::V3f& world) {
  const std::size_t channels = texture.channel_count();
  std::array<double, 3> fraction{};
  std::array<std::int64_t, 3> low{};
  for (int axis = 0; axis < 3; ++axis) {
    const double from_center = 2.0 * static_cast<double>(world[axis]) - 0.5;
    low[static_cast<std::size_t>(axis)] = static_cast<std::int64_t>(std::floor(from_center));
    fraction[static_cast<std::size_t>(axis)] = from_center - std::floor(from_center);
  }
  const std::vector<float> corners = voxels(texture, low, {2, 2, 2});
  std::vector<Reference> references;
  for (std::size_t c = 0; c < channels; ++c) {
    double value = 0, least = corners[c], most = corners[c], size = 0;
    for (std::size_t corner = 0; corner < 8; ++corner) {
      const double found = corners[corner * channels + c];
      double weight = 1;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        weight *= (corner >> axis & 1) != 0 ? fraction[axis] : 1 - fraction[axis];
      }
      value += weight * found;
      least = std::min(least, found), most = std::max(most, found);
      size = std::max(size, std::abs(found));
    }
    // The host rounds each coordinate a few times in float, at most kEdge in size; the sum of
    // eight.
    const double position = 4 * kEdge * 0x1p-24;
    references.push_back({value, 3 * position * (most - least) + 16 * size * 0x1p-24});
  }
  return references;
}

// Looks up points and returns how many channels miss the reference by more than the bound and the
// rounding of pixels.
int wrong_lookups(OIIO::TextureSystem& system, const std::string& name,
                  const solidtex::texture& texture, const std::vector<Imath::V3f>& points,
                  double pixel_rounding) {
  int wrong = 0;
  const auto channels = static_cast<int>(texture.channel_count());
  for (const Imath::V3f& point : points) {
    OIIO::TextureOpt options;
    std::vector<float> found(texture.channel_count());
    const Imath::V3f none(0, 0, 0);
    if (!system.texture3d(OIIO::ustring(name), options, point, none, none, none, channels,
                          found.data())) {
      return static_cast<int>(points.size());
    }
    const std::vector<Reference> expected = trilinear(texture, point);
    for (std::size_t c = 0; c < found.size(); ++c) {
      const double allowed = expected[c].bound + pixel_rounding;
      if (!(std::abs(found[c] - expected[c].value) <= allowed)) ++wrong;
    }
  }
  return wrong;
}

}  // namespace

TEST_CASE(
    "texture3d finds what lies between voxels of direct evaluation, within the trilinear bound") {
  for (const std::string& model : {tiny_lattice(), tiny_sampler()}) {
    const solidtex::texture texture(model, {.seed = 11});
    const std::string name = model + "?size=96&seed=11&tile=16&scale=2&type=";
    const System system = small_system();
    const auto points = random_points(1, 500);
    CHECK(wrong_lookups(*system, name + "float", texture, points, 0) == 0);
    // Values of these models are below 2: half a unit of the last of eleven bits.
    CHECK(wrong_lookups(*system, name + "half", texture, points, 0x1p-11) == 0);
    CHECK(wrong_lookups(*system, name + "half", texture, points, 0) > 0);
    const solidtex::texture other(model, {.seed = 12});
    CHECK(wrong_lookups(*system, name + "float", other, points, 0) > 100);
  }
}

TEST_CASE("Threads share a cache that is too small for the volume") {
  const solidtex::texture texture(tiny_lattice());
  const System system = small_system();
  const std::string name = tiny_lattice() + "?size=96&tile=16&scale=2&type=float";
  constexpr unsigned kThreads = 6;
  std::array<int, kThreads> wrong{};
  std::vector<std::thread> threads;
  for (unsigned i = 0; i < kThreads; ++i) {
    threads.emplace_back([&, i] {
      wrong[i] = wrong_lookups(*system, name, texture, random_points(10 + i, 1000), 0);
    });
  }
  for (std::thread& thread : threads) thread.join();
  CHECK(std::all_of(wrong.begin(), wrong.end(), [](int count) { return count == 0; }));
  // The volume has 6^3 tiles of 32 KiB: more than the cache holds, so that some were made again.
  int created = 0;
  REQUIRE(system->getattribute("stat:tiles_created", OIIO::TypeInt, &created));
  CHECK(created > 6 * 6 * 6);
}

TEST_CASE("texture3d selects a level by name, and is black outside the volume") {
  const System system = small_system();
  const OIIO::ustring name(tiny_lattice() + "?size=96&type=float");
  const auto input = open_image(tiny_lattice() + "?size=96&lod=2&type=float");
  const std::vector<float> level = read_all(*input, 0);
  const Imath::V3f none(0, 0, 0);
  for (const int voxel : {0, 7, 23}) {
    OIIO::TextureOpt options;
    options.subimagename = OIIO::ustring("lod2");
    const float texel = 4 * (static_cast<float>(voxel) + 0.5f);
    float found[2];
    REQUIRE(system->texture3d(name, options, {texel, 2, 2}, none, none, none, 2, found));
    CHECK(found[0] == Approx(level[static_cast<std::size_t>(2 * voxel)]).margin(1e-4));
    CHECK(found[1] == Approx(level[static_cast<std::size_t>(2 * voxel) + 1]).margin(1e-4));
  }
  OIIO::TextureOpt options;
  float outside[2] = {1, 1};
  REQUIRE(system->texture3d(name, options, {-50, 2, 2}, none, none, none, 2, outside));
  CHECK(outside[0] == 0);
  CHECK(outside[1] == 0);
}

TEST_CASE("ImageCache reports a name that cannot be opened") {
  const System system = small_system();
  OIIO::TextureOpt options;
  options.missingcolor = nullptr;
  float found[2];
  const Imath::V3f none(0, 0, 0);
  const OIIO::ustring name(tiny_lattice() + "?size=0");
  CHECK_FALSE(system->texture3d(name, options, none, none, none, none, 2, found));
  CHECK_THAT(system->geterror(), ContainsSubstring("size is \"0\""));
}
