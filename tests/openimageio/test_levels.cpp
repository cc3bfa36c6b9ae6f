// Levels of detail: voxels of 2^n texels, means in light.
#include <OpenImageIO/Imath.h>

#include <cmath>

#include "catch.hpp"
#include "tests/openimageio/support.h"

using namespace openimageio_tests;

namespace {

// The mean of a cube of texels as docs/filtering.md defines it: albedo.r, the first of two
// channels, is squared before and rooted after.
std::array<double, 2> mean_of_cube(const solidtex::texture& texture,
                                   std::array<std::int64_t, 3> low, std::int64_t edge) {
  const std::vector<float> texels = voxels(texture, low, {edge, edge, edge});
  std::array<double, 2> sum{};
  for (std::size_t i = 0; i < texels.size(); i += 2) {
    const double encoded = std::max(texels[i], 0.0f);
    sum[0] += encoded * encoded;
    sum[1] += texels[i + 1];
  }
  const double count = static_cast<double>(texels.size() / 2);
  return {std::sqrt(sum[0] / count), sum[1] / count};
}

}  // namespace

TEST_CASE("A volume has levels down to one voxel, named and placed alike") {
  const auto input = open_image(tiny_lattice() + "?size=70x40x20&origin=-8,16,1024&scale=2");
  const std::vector<std::array<int, 3>> sizes = {{70, 40, 20}, {35, 20, 10}, {18, 10, 5},
                                                 {9, 5, 3},    {5, 3, 2},    {3, 2, 1},
                                                 {2, 1, 1},    {1, 1, 1}};
  for (int lod = 0; lod < 8; ++lod) {
    REQUIRE(input->seek_subimage(lod, 0));
    const OIIO::ImageSpec spec = input->spec(lod, 0);
    const std::array<int, 3> size = {spec.width, spec.height, spec.depth};
    CHECK(size == sizes[static_cast<std::size_t>(lod)]);
    CHECK(spec.get_string_attribute("oiio:subimagename") == "lod" + std::to_string(lod));
    CHECK(spec.get_int_attribute("solidtex:lod") == lod);
    // A texel lies at the same place of the world at every level.
    const OIIO::ParamValue* found = spec.find_attribute("worldtolocal", OIIO::TypeMatrix);
    REQUIRE(found);
    const auto* matrix = static_cast<const Imath::M44f*>(found->data());
    Imath::V3f local;
    matrix->multVecMatrix(Imath::V3f(10, 9, 513), local);  // texel (20, 18, 1026), two a unit
    CHECK(local.x * static_cast<float>(spec.width << lod) == Approx(28));
    CHECK(local.y * static_cast<float>(spec.height << lod) == Approx(2));
    CHECK(local.z * static_cast<float>(spec.depth << lod) == Approx(2).margin(1e-3));
  }
  CHECK_FALSE(input->seek_subimage(8, 0));
  const auto largest = open_image(tiny_lattice() + "?size=65536");
  CHECK(largest->seek_subimage(9, 0));
  CHECK_FALSE(largest->seek_subimage(10, 0));
}

TEST_CASE("lod selects a single level") {
  const auto all = open_image(tiny_lattice() + "?size=40&type=float");
  const auto one = open_image(tiny_lattice() + "?lod=2&size=40&type=float");
  CHECK(one->spec(0, 0).width == 10);
  CHECK(one->spec(0, 0).get_string_attribute("oiio:subimagename") == "lod2");
  CHECK_FALSE(one->seek_subimage(1, 0));
  CHECK(read_all(*one, 0) == read_all(*all, 2));
}

TEST_CASE("Voxels of the lattice family are means of their texels") {
  const solidtex::texture texture(tiny_lattice(), {.seed = 5});
  const auto input =
      open_image(tiny_lattice() + "?size=24x16x16&seed=5&origin=-16,8,64&type=float");
  for (int lod = 1; lod <= 3; ++lod) {
    const OIIO::ImageSpec spec = input->spec(lod, 0);
    const std::vector<float> found = read_all(*input, lod);
    std::size_t at = 0;
    for (int z = 0; z < spec.depth; ++z)
      for (int y = 0; y < spec.height; ++y)
        for (int x = 0; x < spec.width; ++x) {
          const auto expected =
              mean_of_cube(texture, {-16 + (x << lod), 8 + (y << lod), 64 + (z << lod)}, 1 << lod);
          REQUIRE(found[at++] == Approx(expected[0]).margin(1e-5));
          REQUIRE(found[at++] == Approx(expected[1]).margin(1e-5));
        }
  }
}

TEST_CASE("Far levels of the lattice family are the mean of the material") {
  const auto input = open_image(tiny_lattice() + "?size=256&lod=6&type=float");
  const std::vector<float> found = read_all(*input, 0);
  REQUIRE(found.size() == 4 * 4 * 4 * 2);
  const auto mean = mean_of_cube(solidtex::texture(tiny_lattice()), {1000, 0, 0}, 48);
  for (std::size_t i = 0; i < found.size(); i += 2) {
    REQUIRE(found[i] == Approx(mean[0]).margin(0.02));
    REQUIRE(found[i + 1] == Approx(mean[1]).margin(0.02));
  }
}

TEST_CASE("Voxels of the sampler family are filtered points") {
  const solidtex::texture texture(tiny_sampler());
  const auto input = open_image(tiny_sampler() + "?size=32x16x16&origin=100,0,-7&type=float");
  for (int lod = 1; lod <= 5; ++lod) {
    const OIIO::ImageSpec spec = input->spec(lod, 0);
    std::vector<float> expected(read_all(*input, lod).size()), centers;
    const float edge = static_cast<float>(1 << lod);
    for (int z = 0; z < spec.depth; ++z)
      for (int y = 0; y < spec.height; ++y)
        for (int x = 0; x < spec.width; ++x) {
          for (const int i : {x, y, z}) centers.push_back((static_cast<float>(i) + 0.5f) * edge);
        }
    const std::vector<float> radii(centers.size() / 3, edge / 2);
    texture.eval_filtered({100, 0, -7}, centers, radii, expected);
    CHECK(read_all(*input, lod) == expected);
  }
}
