#include "tests/openimageio/support.h"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "catch.hpp"
#include "tests/api/tiny_model.h"

namespace openimageio_tests {
namespace {

namespace fs = std::filesystem;

// A folder of its own for each process, removed at its end.
class ModelFolder {
 public:
  ModelFolder() {
    std::string path = (fs::temp_directory_path() / "solidtex-openimageio-XXXXXX").string();
    REQUIRE(mkdtemp(path.data()));
    path_ = path;
    write("tiny-lattice.solidtex", tiny_lattice_file());
    write("tiny-sampler.solidtex", tiny_sampler_file());
  }
  ~ModelFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  std::string file(const char* name) const { return (path_ / name).string(); }

 private:
  void write(const char* name, const std::vector<std::byte>& bytes) const {
    std::ofstream file(path_ / name, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    REQUIRE(file.good());
  }
  fs::path path_;
};

const ModelFolder& models() {
  static const ModelFolder folder;
  return folder;
}

}  // namespace

std::string tiny_lattice() { return models().file("tiny-lattice.solidtex"); }

std::string tiny_sampler() { return models().file("tiny-sampler.solidtex"); }

void register_plugin() { REQUIRE(OIIO::attribute("plugin_searchpath", SOLIDTEX_PLUGINS)); }

std::unique_ptr<OIIO::ImageInput> open_image(const std::string& name) {
  register_plugin();
  auto input = OIIO::ImageInput::open(name);
  INFO(OIIO::geterror());
  REQUIRE(input);
  REQUIRE(std::string(input->format_name()) == "solidtex");
  return input;
}

std::string refusal(const std::string& name) {
  register_plugin();
  INFO(name);
  REQUIRE_FALSE(OIIO::ImageInput::open(name));
  REQUIRE_FALSE(OIIO::geterror().empty());
  const auto input = OIIO::ImageInput::create("solidtex");
  REQUIRE(input);
  OIIO::ImageSpec spec;
  REQUIRE_FALSE(input->open(name, spec));
  return input->geterror();
}

std::vector<float> read_all(OIIO::ImageInput& input, int subimage) {
  const OIIO::ImageSpec spec = input.spec_dimensions(subimage, 0);
  std::vector<float> pixels(spec.image_pixels() * static_cast<std::size_t>(spec.nchannels));
  const bool is_read =
      input.read_image(subimage, 0, 0, spec.nchannels, OIIO::TypeFloat, pixels.data());
  INFO(input.geterror());
  REQUIRE(is_read);
  return pixels;
}

std::vector<float> voxels(const solidtex::texture& texture, std::array<std::int64_t, 3> low,
                          std::array<std::int64_t, 3> size) {
  const std::size_t channels = texture.channel_count();
  std::vector<float> pixels;
  for (std::int64_t z = 0; z < size[2]; ++z)
    for (std::int64_t y = 0; y < size[1]; ++y)
      for (std::int64_t x = 0; x < size[0]; ++x) {
        std::vector<float> voxel(channels);
        texture.eval_box({low[0] + x, low[1] + y, low[2] + z}, {1, 1, 1}, voxel);
        pixels.insert(pixels.end(), voxel.begin(), voxel.end());
      }
  return pixels;
}

float rounded_to_half(float value) { return static_cast<float>(half(value)); }

}  // namespace openimageio_tests
