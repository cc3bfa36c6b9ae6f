#include "plugins/mesh/atlas.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "plugins/mesh/dilation.h"
#include "plugins/mesh/uv_triangle.h"

namespace solidtex::mesh {
namespace {

constexpr int kCell = 64;  // texels along the edge of a cell
// Weights of corners: by rounding, the middle of an edge may lie a little outside of both sides.
constexpr double kEdge = -1e-9, kWellInside = 1e-6;
constexpr float kUvTolerance = 1e-4f;  // texture coordinates that exporters have rounded

void check_uvs(const Mesh& mesh) {
  if (mesh.uvs.empty()) {
    throw MeshError(mesh.file +
                    ": found no texture coordinates (UV), expected some: unwrap the mesh first, or "
                    "bake vertex colors");
  }
  for (const glm::vec2& uv : mesh.uvs) {
    const glm::vec2 beyond = glm::max(-uv, uv - 1.0f);
    if (std::max(beyond.x, beyond.y) <= kUvTolerance) continue;
    throw MeshError(mesh.file + ": found the texture coordinates (" + std::to_string(uv.x) + ", " +
                    std::to_string(uv.y) + "), expected an atlas: all from 0 to 1");
  }
}

// The texels whose center may lie between two coordinates.
int first_texel(double low) { return static_cast<int>(std::ceil(low - 0.5 - 1e-6)); }
int end_texel(double high) { return static_cast<int>(std::floor(high - 0.5 + 1e-6)) + 1; }

AtlasRegion common(const AtlasRegion& a, const AtlasRegion& b) {
  return {{std::max(a.low[0], b.low[0]), std::max(a.low[1], b.low[1])},
          {std::min(a.high[0], b.high[0]), std::min(a.high[1], b.high[1])}};
}

AtlasRegion box_of(const UvTriangle& triangle) {
  return {{first_texel(triangle.low().x), first_texel(triangle.low().y)},
          {end_texel(triangle.high().x), end_texel(triangle.high().y)}};
}

std::size_t index_in(const AtlasRegion& region, int x, int y) {
  return static_cast<std::size_t>(y - region.low[1]) * static_cast<std::size_t>(region.width()) +
         static_cast<std::size_t>(x - region.low[0]);
}

// The points and footprints of texels, for one query.
struct Batch {
  std::vector<float> points, axes;

  void add(const UvTriangle& triangle, const Placement& placement, const glm::dvec2& texel) {
    const double scale = placement.texels_per_unit;
    const glm::vec3 point(triangle.position(texel) * scale);
    const glm::vec3 right(triangle.right() * (0.5 * scale)), down(triangle.down() * (0.5 * scale));
    points.insert(points.end(), {point.x, point.y, point.z});
    axes.insert(axes.end(), {right.x, right.y, right.z, down.x, down.y, down.z, 0, 0, 0});
  }

  // Values [point][channel].
  std::vector<float> evaluate(const texture& texture, const Placement& placement) const {
    std::vector<float> found(points.size() / 3 * texture.channel_count());
    texture.eval_footprints(placement.origin, points, axes, found);
    return found;
  }
};

// Normal of a relief in tangent space, by the differences of its height across a texel.
glm::vec3 tangent_normal(const UvTriangle& triangle, double to_right, double to_down) {
  const double width = glm::length(triangle.right());
  const glm::dvec3 tangent = triangle.right() / width, up = -triangle.down();
  const double shear = glm::dot(up, tangent);
  const double height = glm::length(up - shear * tangent);
  const double along_u = to_right / width;
  const double along_v = (-to_down - shear * along_u) / height;
  return glm::vec3(glm::normalize(glm::dvec3(-along_u, -along_v, 1)));
}

}  // namespace

Atlas::Atlas(std::shared_ptr<const Mesh> mesh, const Placement& placement, int size, int margin)
    : mesh_(std::move(mesh)),
      placement_(placement),
      size_(size),
      margin_(margin),
      cells_across_((size + kCell - 1) / kCell) {
  check_uvs(*mesh_);
  sort_into_cells();
}

void Atlas::sort_into_cells() {
  cells_.resize(static_cast<std::size_t>(cells_across_) * static_cast<std::size_t>(cells_across_));
  const AtlasRegion whole{{0, 0}, {size_, size_}};
  bool has_area = false;
  for (std::size_t t = 0; t < mesh_->triangles.size(); ++t) {
    const auto triangle = UvTriangle::of(*mesh_, t, size_);
    if (!triangle) continue;
    has_area = true;
    const AtlasRegion box = common(box_of(*triangle), whole);
    if (box.width() <= 0 || box.height() <= 0) continue;
    for (int y = box.low[1] / kCell; y <= (box.high[1] - 1) / kCell; ++y)
      for (int x = box.low[0] / kCell; x <= (box.high[0] - 1) / kCell; ++x)
        cells_[cell_at(y, x)].push_back(static_cast<std::uint32_t>(t));
  }
  if (!has_area) {
    throw MeshError(mesh_->file +
                    ": found texture coordinates without any area, expected an atlas");
  }
}

// Calls visit(x, y, triangle, weight of its least corner), triangles of a texel in their order.
template <class Visit>
void Atlas::for_each_covered(const AtlasRegion& region, const Visit& visit) const {
  for (int row = region.low[1] / kCell; row * kCell < region.high[1]; ++row)
    for (int column = region.low[0] / kCell; column * kCell < region.high[0]; ++column) {
      const AtlasRegion cell{{column * kCell, row * kCell},
                             {(column + 1) * kCell, (row + 1) * kCell}};
      const AtlasRegion part = common(region, cell);
      for (const std::uint32_t t : cells_[cell_at(row, column)]) {
        const auto triangle = UvTriangle::of(*mesh_, t, size_);
        const AtlasRegion box = common(box_of(*triangle), part);
        for (int y = box.low[1]; y < box.high[1]; ++y)
          for (int x = box.low[0]; x < box.high[0]; ++x) {
            const double inside = triangle->inside({x + 0.5, y + 0.5});
            if (inside >= kEdge) visit(x, y, t, inside);
          }
      }
    }
}

std::vector<std::uint32_t> Atlas::covering_triangles(const AtlasRegion& region) const {
  std::vector<std::uint32_t> triangles(index_in(region, region.low[0], region.high[1]), kUncovered);
  for_each_covered(region, [&](int x, int y, std::uint32_t triangle, double) {
    std::uint32_t& first = triangles[index_in(region, x, y)];
    if (first == kUncovered) first = triangle;
  });
  return triangles;
}

std::size_t Atlas::overlapping_texels(const AtlasRegion& region) const {
  std::vector<unsigned char> counts(index_in(region, region.low[0], region.high[1]));
  std::size_t overlapping = 0;
  for_each_covered(region, [&](int x, int y, std::uint32_t, double inside) {
    if (inside < kWellInside) return;
    unsigned char& count = counts[index_in(region, x, y)];
    if (count < 2 && ++count == 2) ++overlapping;
  });
  return overlapping;
}

// The covered texels that a region repeats, each once, and for each texel of the region the index
// of its own, or kUncovered.
struct Atlas::Sources {
  struct Texel {
    UvTriangle triangle;
    glm::dvec2 center;
  };
  std::vector<Texel> texels;
  std::vector<std::uint32_t> indices;
};

Atlas::Sources Atlas::sources_of(const AtlasRegion& region) const {
  const AtlasRegion wide = common({{region.low[0] - margin_, region.low[1] - margin_},
                                   {region.high[0] + margin_, region.high[1] + margin_}},
                                  {{0, 0}, {size_, size_}});
  const std::vector<std::uint32_t> triangles = covering_triangles(wide);
  Sources sources{{}, nearest_covered(triangles, wide, region, margin_)};
  std::vector<std::uint32_t> slots(triangles.size(), kUncovered);
  const auto width = static_cast<std::uint32_t>(wide.width());
  for (std::uint32_t& index : sources.indices) {
    if (index == kUncovered) continue;
    std::uint32_t& slot = slots[index];
    if (slot == kUncovered) {
      slot = static_cast<std::uint32_t>(sources.texels.size());
      const glm::dvec2 corner(wide.low[0] + static_cast<int>(index % width),
                              wide.low[1] + static_cast<int>(index / width));
      sources.texels.push_back({*UvTriangle::of(*mesh_, triangles[index], size_), corner + 0.5});
    }
    index = slot;
  }
  return sources;
}

void Atlas::evaluate(const texture& texture, const AtlasRegion& region, float* values) const {
  const Sources sources = sources_of(region);
  Batch batch;
  for (const auto& [triangle, center] : sources.texels) batch.add(triangle, placement_, center);
  const std::vector<float> found = batch.evaluate(texture, placement_);
  const std::size_t channels = texture.channel_count();
  for (const std::uint32_t index : sources.indices) {
    if (index == kUncovered) {
      values = std::fill_n(values, channels, 0.0f);
    } else {
      values = std::copy_n(&found[index * channels], channels, values);
    }
  }
}

void Atlas::evaluate_normals(const texture& texture, const AtlasRegion& region, std::size_t channel,
                             double depth, float* normals) const {
  const Sources sources = sources_of(region);
  const glm::dvec2 sides[] = {{-0.5, 0}, {0.5, 0}, {0, -0.5}, {0, 0.5}};
  Batch batch;
  for (const auto& [triangle, center] : sources.texels) {
    for (const glm::dvec2& side : sides) batch.add(triangle, placement_, center + side);
  }
  const std::vector<float> found = batch.evaluate(texture, placement_);
  const auto height = [&](std::size_t texel, std::size_t side) {
    return depth *
           static_cast<double>(found[(4 * texel + side) * texture.channel_count() + channel]);
  };
  for (const std::uint32_t index : sources.indices) {
    glm::vec3 normal(0, 0, 1);
    if (index != kUncovered) {
      normal = tangent_normal(sources.texels[index].triangle, height(index, 1) - height(index, 0),
                              height(index, 3) - height(index, 2));
    }
    normals = std::copy_n(&normal.x, 3, normals);
  }
}

}  // namespace solidtex::mesh
