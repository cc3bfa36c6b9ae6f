// A UV atlas: the picture that a mesh's own texture coordinates unroll its surface to.
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

// Square; texel (x, y) is at u = (x + 0.5) / size, v = 1 - (y + 0.5) / size. A texel whose centre
// lies in a triangle has the mean of the solid texture over what the texel covers of its plane; of
// several triangles the first one counts. Beyond the edges the values of the nearest such texel go
// on for `margin` texels, so that no filter takes in what lies outside; further off is 0.
// A value depends on its place alone, not on the region that is asked for. Immutable: any number of
// threads may ask.
class Atlas {
 public:
  static constexpr int kMaxSize = 1 << 14, kMaxMargin = 64, kDefaultMargin = 8;

  // Throws MeshError for a mesh without texture coordinates, with some outside of [0, 1], or whose
  // triangles have no area there.
  Atlas(std::shared_ptr<const Mesh> mesh, const Placement& placement, int size,
        int margin = kDefaultMargin);

  int size() const { return size_; }

  // Values [y][x][channel] of a region inside of the atlas. Queries run on the calling thread's
  // oneTBB arena. Throws solidtex::error.
  void evaluate(const texture& texture, const AtlasRegion& region, float* values) const;

  // How many texels of a region have their centre well inside of more than one triangle: there the
  // mesh's parts share a place, and one colour cannot suit them all.
  std::size_t overlapping_texels(const AtlasRegion& region) const;

 private:
  using Cell = std::vector<std::uint32_t>;  // triangles, in their order

  void sort_into_cells();
  template <class Visit>
  void for_each_covered(const AtlasRegion& region, const Visit& visit) const;
  std::vector<std::uint32_t> covering_triangles(const AtlasRegion& region) const;

  std::shared_ptr<const Mesh> mesh_;
  Placement placement_;
  int size_, margin_, cells_across_;
  std::vector<Cell> cells_;
};

}  // namespace solidtex::mesh
