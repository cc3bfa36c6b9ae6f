// What an image says about itself, and its pixels at level 0.
#include <chrono>
#include <future>

#include "catch.hpp"
#include "tests/openimageio/support.h"

using namespace openimageio_tests;

TEST_CASE("An image describes its volume") {
  const auto input = open_image(tiny_lattice() + "?size=70x40x20&seed=7&origin=-8,16,1024&scale=2");
  const OIIO::ImageSpec spec = input->spec(0, 0);
  CHECK(spec.width == 70);
  CHECK(spec.height == 40);
  CHECK(spec.depth == 20);
  CHECK(spec.full_depth == 20);
  CHECK(spec.tile_width == 32);
  CHECK(spec.tile_height == 32);
  CHECK(spec.tile_depth == 32);
  CHECK(spec.format == OIIO::TypeHalf);
  CHECK(spec.channelnames == std::vector<std::string>{"albedo.r", "rough"});
  CHECK(spec.alpha_channel == -1);
  CHECK(spec.get_string_attribute("oiio:ColorSpace") == "sRGB");
  CHECK(spec.get_string_attribute("oiio:subimagename") == "lod0");
  CHECK(spec.get_string_attribute("solidtex:model") == "tiny-lattice");
  CHECK(spec["solidtex:seed"].get<int>() == 7);
  CHECK(input->spec(0, 1).format == OIIO::TypeUnknown);
  CHECK(input->spec(99, 0).format == OIIO::TypeUnknown);

  const auto linear = open_image(tiny_sampler() + "?type=float");
  CHECK(linear->spec(0, 0).get_string_attribute("oiio:ColorSpace") == "Linear");
  CHECK(linear->spec(0, 0).format == OIIO::TypeFloat);
  CHECK(linear->spec(0, 0).width == 256);
}

TEST_CASE("The fourth channel is not alpha, and a shipped model needs no path") {
  const auto input = open_image("paint-rusted.solidtex?size=8");
  const OIIO::ImageSpec spec = input->spec(0, 0);
  CHECK(spec.nchannels == static_cast<int>(solidtex::texture("paint-rusted").channel_count()));
  CHECK(spec.nchannels > 3);
  CHECK(spec.alpha_channel == -1);
}

TEST_CASE("Float pixels are the bits of the texture, half pixels those rounded once") {
  for (const std::string& model : {tiny_lattice(), tiny_sampler()}) {
    const solidtex::texture texture(model, {.seed = 3});
    const std::string query = "?size=37x19x21&tile=16&seed=3&origin=-20,5,1000000000";
    const std::vector<float> expected = voxels(texture, {-20, 5, 1000000000}, {37, 19, 21});
    CHECK(read_all(*open_image(model + query + "&type=float"), 0) == expected);
    std::vector<float> rounded = expected;
    for (float& value : rounded) value = rounded_to_half(value);
    CHECK(rounded != expected);
    CHECK(read_all(*open_image(model + query + "&type=half"), 0) == rounded);
  }
}

TEST_CASE("A slice is a flat image") {
  const auto input = open_image(tiny_lattice() + "?size=20x30x1&type=float&origin=0,0,9");
  CHECK(input->spec(0, 0).depth == 1);
  CHECK(input->spec(0, 0).tile_depth == 1);
  CHECK(read_all(*input, 0) == voxels(solidtex::texture(tiny_lattice()), {0, 0, 9}, {20, 30, 1}));
}

TEST_CASE("A tile is complete beyond the image's edge, in any type, channels and strides") {
  const auto input = open_image(tiny_sampler() + "?size=20&tile=16&type=float");
  const std::vector<float> expected =
      voxels(solidtex::texture(tiny_sampler()), {16, 0, 16}, {16, 16, 16});
  std::vector<float> tile(expected.size());
  REQUIRE(input->read_tiles(0, 0, 16, 32, 0, 16, 16, 32, 0, 3, OIIO::TypeFloat, tile.data()));
  CHECK(tile == expected);

  std::vector<double> blue(16 * 16 * 16 * 2, 9.0);
  REQUIRE(input->read_tiles(0, 0, 16, 32, 0, 16, 16, 32, 2, 3, OIIO::TypeDesc::DOUBLE, blue.data(),
                            2 * sizeof(double)));
  for (std::size_t i = 0; i < expected.size() / 3; ++i) {
    REQUIRE(blue[2 * i] == static_cast<double>(expected[3 * i + 2]));
    REQUIRE(blue[2 * i + 1] == 9);
  }
}

TEST_CASE("Invalid tiles are refused") {
  const auto input = open_image(tiny_lattice() + "?size=64&tile=16");
  std::vector<float> pixels(64 * 64 * 64 * 2);
  const auto reads = [&](int subimage, int miplevel, int begin, int end) {
    return input->read_tiles(subimage, miplevel, begin, end, 0, 16, 0, 16, 0, 2, OIIO::TypeFloat,
                             pixels.data());
  };
  CHECK(reads(0, 0, 0, 16));
  CHECK_FALSE(reads(0, 0, 3, 16));
  CHECK_THAT(input->geterror(), ContainsSubstring("3-16") && ContainsSubstring("whole tiles"));
  CHECK_FALSE(reads(0, 1, 0, 16));
  CHECK_FALSE(reads(-1, 0, 0, 16));
  CHECK_FALSE(reads(7, 0, 0, 16));
  CHECK_THAT(input->geterror(), ContainsSubstring("subimage 7"));
  CHECK_FALSE(input->seek_subimage(0, 1));
  CHECK(input->close());
  CHECK_FALSE(reads(0, 0, 0, 16));
}

TEST_CASE("Tiles are made while another thread holds the reader's lock") {
  const auto input = open_image(tiny_lattice() + "?size=40&tile=16&type=float");
  const std::vector<float> expected = read_all(*input, 0);
  std::vector<float> found(expected.size());
  input->lock();
  auto reading = std::async(std::launch::async, [&] {
    return input->read_tiles(0, 0, 0, 40, 0, 40, 0, 40, 0, 2, OIIO::TypeFloat, found.data());
  });
  const bool is_done = reading.wait_for(std::chrono::seconds(60)) == std::future_status::ready;
  input->unlock();
  CHECK(is_done);
  CHECK(reading.get());
  CHECK(found == expected);
}
