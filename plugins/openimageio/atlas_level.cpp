#include "plugins/openimageio/atlas_level.h"

#include <algorithm>
#include <mutex>
#include <optional>

#include "plugins/mesh/atlas.h"

namespace solidtex::openimageio {
namespace {

constexpr int kAtlasTile = 64;

class AtlasLevel final : public Level {
 public:
  AtlasLevel(std::shared_ptr<const mesh::Mesh> mesh, const mesh::Placement& placement, int size,
             int tile)
      : mesh_(std::move(mesh)), placement_(placement) {
    size_ = {size, size, 1};
    tile_ = {tile, tile, 1};
  }

  // Constructed on first use: most hosts read few levels, and sorting the triangles of a large mesh
  // into all levels takes half as long as loading it. Throws MeshError.
  const mesh::Atlas& atlas() const {
    const std::lock_guard lock(mutex_);
    if (!atlas_) atlas_.emplace(mesh_, placement_, size_[0]);
    return *atlas_;
  }

  // 0 beyond the image.
  void evaluate(const texture& texture, const Region& region, float* values) const override {
    const std::size_t channels = texture.channel_count();
    std::fill_n(values, region.voxel_count() * channels, 0.0f);
    const mesh::AtlasRegion inside{
        {region.low[0], region.low[1]},
        {std::min(region.high[0], size_[0]), std::min(region.high[1], size_[1])}};
    if (inside.width() <= 0 || inside.height() <= 0) return;
    const std::size_t row = static_cast<std::size_t>(inside.width()) * channels;
    std::vector<float> found(row * static_cast<std::size_t>(inside.height()));
    atlas().evaluate(texture, inside, found.data());
    const std::size_t stride = static_cast<std::size_t>(region.size(0)) * channels;
    for (std::size_t y = 0; y * row < found.size(); ++y) {
      std::copy_n(&found[y * row], row, values + y * stride);
    }
  }

 private:
  std::shared_ptr<const mesh::Mesh> mesh_;
  mesh::Placement placement_;
  // Not std::call_once, which ends the process where memory is refused.
  mutable std::mutex mutex_;
  mutable std::optional<mesh::Atlas> atlas_;
};

}  // namespace

std::vector<std::unique_ptr<const Level>> atlas_levels(const Query& query) {
  const auto mesh = std::make_shared<const mesh::Mesh>(mesh::load_mesh(query.mesh));
  const mesh::Placement placement = mesh::place(*mesh, query.origin, query.scale);
  const int tile = query.tile ? query.tile : kAtlasTile;
  std::vector<std::unique_ptr<const Level>> levels;
  for (int size = query.size[0]; size > 0; size /= 2) {
    auto level = std::make_unique<AtlasLevel>(mesh, placement, size, tile);
    if (levels.empty()) level->atlas();  // refuses a mesh without an atlas
    levels.push_back(std::move(level));
  }
  return levels;
}

}  // namespace solidtex::openimageio
