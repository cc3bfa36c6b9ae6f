// Maps of a UV atlas: albedo, normal and single channels, as renderers and engines expect them.
#pragma once

#include <filesystem>
#include <solidtex/solidtex.hpp>
#include <span>
#include <string>
#include <vector>

#include "plugins/mesh/atlas.h"
#include "tools/bake/channels.h"

namespace solidtex::tools {

class MapSet {
 public:
  struct Map {
    std::string name;                   // "albedo", "normal", or of a channel
    std::vector<std::size_t> channels;  // of the model; of a normal its height
    Encoding encoding;
    std::vector<float> values;  // [y][x][component]; encoded; normals from -1 to 1, green up

    bool is_normal() const { return name == "normal"; }
    std::size_t components() const { return is_normal() ? 3 : channels.size(); }
  };

  // No names mean all channels, and a normal map where the model has a height. Throws
  // std::runtime_error for an unknown name, and for a normal map without a height.
  MapSet(const solidtex::texture& texture, const std::vector<std::string>& names, int size);

  int size() const { return size_; }
  std::size_t bytes() const;
  const std::vector<Map>& maps() const { return maps_; }
  const Map* find(const std::string& name) const;  // null if there is none

  // Evaluates a band of rows. `depth`: height of the relief in the mesh's units.
  void evaluate(const mesh::Atlas& atlas, const solidtex::texture& texture,
                const mesh::AtlasRegion& band, double depth);

  // Writes STEM_BaseColor.png and so on. PNG: colors in sRGB and single channels with 8 bits,
  // normals and heights with 16. EXR: linear floats.
  void write(const std::filesystem::path& folder, const std::string& stem, bool is_exr,
             bool is_directx) const;

 private:
  int size_;
  std::vector<Map> maps_;
};

}  // namespace solidtex::tools
