// The query behind a model's name: model.solidtex?size=1024&seed=7&lod=2, or ?mesh=vase.obj.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

namespace solidtex::openimageio {

// A wrong query: what() names the key, what was found and what is expected.
class QueryError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

inline constexpr int kMaxSize = 1 << 16;   // texels along an axis
inline constexpr int kMaxAtlas = 1 << 14;  // texels along the edge of an atlas
inline constexpr int kMaxLod = 9;          // from 2^9 texels on the engine returns only the mean
inline constexpr int kMinTile = 4, kMaxTile = 128;  // voxels

// The part of the material in an image, and its storage.
struct Query {
  std::string model;                          // before the question mark
  std::string mesh;                           // mesh of a UV atlas; empty for a volume
  std::array<int, 3> size = {256, 256, 256};  // texels; of an atlas a square, one deep
  std::array<std::int64_t, 3> origin{};       // texel of the first corner
  std::uint64_t seed = 0;
  std::optional<int> lod;       // this level alone; empty: all levels
  std::optional<double> scale;  // texels per unit of the host's world, or of the mesh
  bool is_half = true;          // pixels are half, else float
  int tile = 0;                 // voxels along an edge at level 0; 0: chosen by the plugin
};

// The last level of detail of a volume: the first that is a single voxel.
int last_lod(const std::array<int, 3>& size);

// Takes a file name apart. Throws QueryError on unknown or repeated keys and values out of range.
Query parse_query(const std::string& name);

}  // namespace solidtex::openimageio
