// UV atlas of a mesh: the image that its texture coordinates parameterize.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <solidtex/solidtex.hpp>
#include <vector>

#include "plugins/mesh/placement.h"

namespace solidtex::mesh {

// Texels [low, high) of an atlas, x and y from its top left corner.
struct AtlasRegion {
  std::array<int, 2> low{}, high{};

  int width() const { return high[0] - low[0]; }
  int height() const { return high[1] - low[1]; }
};

// Square image; texel (x, y) is at u = (x + 0.5) / size, v = 1 - (y + 0.5) / size. A texel with its
// center in a triangle holds the mean of the solid texture over its footprint on the triangle's
// plane; the first of several triangles counts. Dilation repeats the nearest value for `margin`
// texels beyond the charts, so that filters do not mix in the background; the rest is 0.
// A value depends on its position only, not on the region. Immutable: any number of threads may
// evaluate it.
class Atlas {
 public:
  static constexpr int kMaxSize = 1 << 14, kMaxMargin = 64, kDefaultMargin = 8;

  // Throws MeshError for a mesh without texture coordinates, with coordinates outside of [0, 1], or
  // with no triangle of positive area.
  Atlas(std::shared_ptr<const Mesh> mesh, const Placement& placement, int size,
        int margin = kDefaultMargin);

  int size() const { return size_; }

  // Writes values [y][x][channel] of a region inside the atlas. Queries run on the calling thread's
  // oneTBB arena. Throws solidtex::error.
  void evaluate(const texture& texture, const AtlasRegion& region, float* values) const;

  // Writes normals [y][x][3] of a relief in the tangent space of the texture coordinates: x along
  // u, y along v, z along the surface's normal (0, 0, 1 beyond the margin). The height of the
  // relief is `depth`, in the mesh's units, times a channel. Its gradient is measured across each
  // texel.
  void evaluate_normals(const texture& texture, const AtlasRegion& region, std::size_t channel,
                        double depth, float* normals) const;

  // Number of texels of a region with their center well inside several triangles: overlapping
  // charts, for which one color cannot be right.
  std::size_t overlapping_texels(const AtlasRegion& region) const;

 private:
  using Cell = std::vector<std::uint32_t>;  // triangles, in their order

  struct Sources;

  void sort_into_cells();
  std::size_t cell_at(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(cells_across_) +
           static_cast<std::size_t>(column);
  }
  Sources sources_of(const AtlasRegion& region) const;
  template <class Visit>
  void for_each_covered(const AtlasRegion& region, const Visit& visit) const;
  std::vector<std::uint32_t> covering_triangles(const AtlasRegion& region) const;

  std::shared_ptr<const Mesh> mesh_;
  Placement placement_;
  int size_, margin_, cells_across_;
  std::vector<Cell> cells_;
};

}  // namespace solidtex::mesh
