// What the tests of the OpenImageIO plugin share.
#pragma once

#include <OpenImageIO/half.h>
#include <OpenImageIO/imageio.h>

#include <array>
#include <memory>
#include <solidtex/solidtex.hpp>
#include <string>
#include <vector>

namespace openimageio_tests {

// Paths of small models of both families, written once a process.
std::string tiny_lattice();  // channels albedo.r and rough, sRGB
std::string tiny_sampler();  // channels r, g and b, linear

// Opens with the plugin, or fails the test with OpenImageIO's message.
std::unique_ptr<OIIO::ImageInput> open_image(const std::string& name);
// The plugin's message for a name that must not open, neither directly nor by OpenImageIO, which
// says of some that they are malformed before it asks the plugin.
std::string refusal(const std::string& name);
// Tells OpenImageIO where the plugin lies; the functions above do so themselves.
void register_plugin();

// All pixels of a subimage as float.
std::vector<float> read_all(OIIO::ImageInput& input, int subimage);
// The texture's own voxels, in the order of OpenImageIO: [z][y][x][channel].
std::vector<float> voxels(const solidtex::texture& texture, std::array<std::int64_t, 3> low,
                          std::array<std::int64_t, 3> size);
float rounded_to_half(float value);

}  // namespace openimageio_tests
