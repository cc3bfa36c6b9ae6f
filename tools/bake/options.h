// The command line of solidtex-bake.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tools/bake/output.h"
#include "tools/bake/volume.h"

namespace solidtex::tools {

struct BakeOptions {
  std::string model = "granite-grey";
  Index3 size{128, 128, 128};
  bool has_size = false;  // given on the command line
  Index3 origin{0, 0, 0};
  std::uint64_t seed = 0;
  bool is_periodic = false;  // opposite faces of the cube meet
  std::string precision = "full";
  std::int64_t block = 0;  // 0: chosen by the program
  int threads = 0;         // 0: all
  std::filesystem::path output, preview;
  std::string show;
  std::string format, depth, color_space, channels;  // of the output; empty: its default
  bool is_labels = false;
  VoxelSize voxel_size;
  std::int64_t shard_size = 0;       // of a store; 0: chosen by the program
  std::int64_t part = 1, parts = 1;  // of the shards of a store
  std::filesystem::path mesh;        // empty: a box of voxels
  std::filesystem::path checkpoint;  // empty: none
  std::string to, color_type = "uchar";
  double texels_per_unit = 0;  // 0: chosen by the size of the mesh
  int margin = 8;
  std::vector<std::string> maps;  // empty: none, or all in a .glb
  std::string normal_map = "opengl";
  double relief = 0;  // height of a normal map's relief in texels; 0: its default
  bool force = false;

  OutputRequest request() const {
    return {output, format, depth, color_space, channels, voxel_size, is_labels};
  }
};

void add_options(CLI::App& app, BakeOptions& options);

}  // namespace solidtex::tools
