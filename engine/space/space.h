// A validated texture space: docs/space-format.md as C++ values.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "engine/model/model.h"

namespace solidtex::engine {

// Mean and principal axes of a photograph's colors, rows of [basis | mean]:
// color[r] = mean[r] + sum of basis[r][k] * y[k] for a whitened value y.
using Colors = std::array<float, 12>;

// Sizes of the lattice generator (docs/file-format.md names its nodes).
struct LatticeSizes {
  int levels = 0, noise_channels = 0, step_channels = 0;
  double negative_slope = 0;
};

struct SamplerSizes {
  int octaves = 0, hidden_layers = 0, width = 0;
  double negative_slope = 0;
  bool has_bounded_transforms = false;  // otherwise Q gives the entries of T_i
};

// Material of a space.
struct Material {
  std::vector<float> code;
  Colors colors{};  // zeros where the space has none
};

// Training photograph.
struct Photograph {
  std::string name;
  Material material;
};

// A space that is an encoder alone.
struct NoGenerator {};

struct Space {
  std::string label;  // path of the file
  std::string name, license, sha256, metadata_json;
  std::variant<LatticeSizes, SamplerSizes, NoGenerator> sizes;
  bool has_colors = false;  // the network gives whitened values
  bool is_upright = false;  // grain runs along z, along columns of the photographs
  int patch = 0, resolution = 0;
  std::size_t code_size = 0;
  double style_slope = 0;
  std::vector<Photograph> photographs;
  std::map<std::string, Tensor> tensors;  // float32
  std::vector<std::byte> encoder;         // ONNX file
};

// Convolution of the lattice generator; weight [outputs, inputs, kernel, kernel, kernel].
struct Convolution {
  std::string name;
  int inputs = 0, outputs = 0, kernel = 0;
  bool is_last = false;  // gives the values; has no condition
};
std::vector<Convolution> lattice_convolutions(const LatticeSizes& sizes);

// Reads and validates a file. Throws Error that names the file, the field, what was found and what
// was expected.
Space read_space(const std::filesystem::path& path);
Space parse_space(std::span<const std::byte> bytes, const std::string& label);

}  // namespace solidtex::engine
