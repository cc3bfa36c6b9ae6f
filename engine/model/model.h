// A validated model file: docs/file-format.md as C++ values.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace solidtex::engine {

struct Tensor {
  std::vector<std::int64_t> shape;
  std::vector<float> values;  // row-major, finite
};

enum class Distribution { uniform, normal };

enum class NoiseScheme { solidtex_1, solidtexturenets };

// Operations of the lattice family.
struct NoiseOp {
  Distribution distribution = Distribution::uniform;
};
// One channel of sines: sin of the phase f . (x, y, z) + phase. 2^32 is one turn; phases wrap.
struct Wave {
  std::array<std::uint32_t, 3> frequency{};
  std::uint32_t phase = 0;
};
struct PeriodicOp {
  std::vector<Wave> waves;  // [channel]
};
struct Conv3dOp {
  int kernel = 1;  // odd; weight [out, in, k, k, k]
  Tensor weight, bias;
};
struct ConvTranspose3dOp {
  int kernel = 2, padding = 0;  // stride 2; weight [in, out, k, k, k]
  Tensor weight, bias;
};
struct UpsampleOp {};
struct ConcatOp {};
struct AffineOp {
  Tensor scale, shift;
};
struct LeakyReluOp {
  float negative_slope = 0;
};
struct TanhOp {};
struct SigmoidOp {};
struct SoftmaxOp {};  // across the channels

using Op = std::variant<NoiseOp, PeriodicOp, Conv3dOp, ConvTranspose3dOp, UpsampleOp, ConcatOp,
                        AffineOp, LeakyReluOp, TanhOp, SigmoidOp, SoftmaxOp>;

struct Node {
  std::string name;
  Op op;
  std::vector<int> inputs;  // indices of earlier nodes
  int level = 0;            // voxel pitch is 2^level texels
  int channels = 0;
};

// Lattice family: nodes in topological order, the last one is the output.
struct LatticeModel {
  std::vector<Node> nodes;
};

// Sampler family: the sampler S of GramGAN.
struct SamplerModel {
  int octaves = 0, width = 0;
  float negative_slope = 0;
  Tensor transforms;  // [n, 3, 3]
  Tensor constant;    // [m]
  struct HiddenLayer {
    Tensor weight, bias;  // [m, m], [m]
    Tensor noise;         // [m, n/(L-1)]; empty for the last hidden layer
  };
  std::vector<HiddenLayer> hidden;
  Tensor output_weight, output_bias;  // [c, m], [c]
};

struct Model {
  std::string name;
  std::vector<std::string> channels;
  std::string color_space;
  NoiseScheme noise_scheme = NoiseScheme::solidtex_1;
  std::variant<LatticeModel, SamplerModel> architecture;
  std::string metadata_json;  // the document as stored
  std::uint64_t parameter_count = 0;
};

// Reads and validates a file. Throws Error that names the file, the field, what was found and what
// was expected.
Model read_model(const std::filesystem::path& path);

// Reads and validates bytes in memory. `label` is the file name in messages.
Model parse_model(std::span<const std::byte> bytes, const std::string& label);

}  // namespace solidtex::engine
