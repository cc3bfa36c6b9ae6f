// Names that cannot be opened: the message names the key, what was found and what is expected.
#include "catch.hpp"
#include "tests/openimageio/support.h"

using namespace openimageio_tests;

TEST_CASE("Hostile queries are refused with a message") {
  struct Case {
    std::string query, key, found;
  };
  const std::string many(100000, '9');
  const std::vector<Case> cases = {
      {"size=0", "size", "\"0\""},
      {"size=-1", "size", "\"-1\""},
      {"size=nan", "size", "\"nan\""},
      {"size=1e3", "size", "\"1e3\""},
      {"size=64.5", "size", "\"64.5\""},
      {"size=", "size", "\"\""},
      {"size= 64", "size", "\" 64\""},
      {"size=+64", "size", "\"+64\""},
      {"size=65537", "size", "\"65537\""},
      {"size=4294967297", "size", "\"4294967297\""},
      {"size=18446744073709551617", "size", "\"18446744073709551617\""},
      {"size=" + many, "size", "999...\""},
      {"size=64x64", "size", "\"64x64\""},
      {"size=64x64x64x64", "size", "\"64x64x64x64\""},
      {"size=64x0x64", "size", "\"64x0x64\""},
      {"size=64xx64", "size", "\"64xx64\""},
      {"size=64\n&seed=1", "size", "\"64?\""},
      {"seed=-1", "seed", "\"-1\""},
      {"seed=18446744073709551616", "seed", "\"18446744073709551616\""},
      {"seed=0x10", "seed", "\"0x10\""},
      {"lod=-1", "lod", "\"-1\""},
      {"lod=10", "lod", "\"10\""},
      {"lod=7&size=64", "lod", "\"7\""},
      {"size=64&lod=99999999999", "lod", "\"99999999999\""},
      {"origin=1,2", "origin", "\"1,2\""},
      {"origin=1,2,3,4", "origin", "\"1,2,3,4\""},
      {"origin=0,0,1073741825", "origin", "\"0,0,1073741825\""},
      {"origin=0,nan,0", "origin", "\"0,nan,0\""},
      {"scale=0", "scale", "\"0\""},
      {"scale=-2", "scale", "\"-2\""},
      {"scale=nan", "scale", "\"nan\""},
      {"scale=inf", "scale", "\"inf\""},
      {"scale=1e999", "scale", "\"1e999\""},
      {"scale=1e-30", "scale", "\"1e-30\""},
      {"type=uint8", "type", "\"uint8\""},
      {"tile=0", "tile", "\"0\""},
      {"tile=24", "tile", "\"24\""},
      {"tile=256", "tile", "\"256\""},
      {"sise=64", "key", "\"sise\""},
      {"Size=64", "key", "\"Size\""},
      {"=64", "key", "\"\""},
      {"", "query", "\"\""},
      {"size", "query", "\"size\""},
      {"size=64&", "query", "\"\""},
      {"size=64&size=64", "query", "size twice"},
      {"size=64?seed=1", "size", "\"64?seed=1\""},
  };
  for (const std::string& model : {tiny_lattice(), std::string("granite-grey.solidtex")}) {
    for (const Case& each : cases) {
      std::string name = model;
      name += "?";
      name += each.query;
      const std::string message = refusal(name);
      INFO(message);
      CHECK_THAT(message, ContainsSubstring(model) && ContainsSubstring(each.key) &&
                              ContainsSubstring(each.found) && ContainsSubstring("expected"));
      CHECK(message.size() < model.size() + 300);
    }
  }
}

TEST_CASE("Bounds themselves are allowed") {
  for (const char* query : {"size=1", "size=65536", "size=1x65536x1", "seed=18446744073709551615",
                            "lod=0", "lod=8", "lod=9&size=65536", "origin=-1073741824,1073741824,0",
                            "scale=1e-9", "scale=1000000000", "tile=4", "tile=128", "type=half"}) {
    CHECK(open_image(tiny_lattice() + "?" + query)->spec(0, 0).width > 0);
  }
}

TEST_CASE("The farthest tile of the largest volume can be made") {
  for (const std::string& model : {tiny_lattice(), tiny_sampler()}) {
    const auto input =
        open_image(model + "?size=65536&tile=4&origin=1073741824,1073741824,1073741824");
    for (int lod = 0; lod <= 9; ++lod) {
      const OIIO::ImageSpec spec = input->spec(lod, 0);
      const int low = spec.width - spec.tile_width;
      std::vector<float> tile(spec.tile_pixels() * static_cast<std::size_t>(spec.nchannels));
      const bool is_read =
          input->read_tiles(lod, 0, low, spec.width, low, spec.width, low, spec.width, 0,
                            spec.nchannels, OIIO::TypeFloat, tile.data());
      INFO(lod << ": " << input->geterror());
      CHECK(is_read);
    }
  }
}

TEST_CASE("Invalid models are refused") {
  CHECK_THAT(refusal("/nowhere/oak.solidtex?size=64"), ContainsSubstring("/nowhere/oak.solidtex"));
  CHECK_THAT(refusal("unknown-wood.solidtex"),
             ContainsSubstring("unknown-wood") && ContainsSubstring("granite-grey"));
  CHECK_THAT(refusal("/dev/null.solidtex/?size=64"), ContainsSubstring("/dev/null.solidtex"));
  const std::string folder = tiny_lattice().substr(0, tiny_lattice().rfind('/'));
  CHECK_FALSE(refusal(folder + "/.solidtex").empty());
  CHECK_FALSE(refusal("?size=64").empty());
}
