#include "plugins/openimageio/volume_level.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace solidtex::openimageio {
namespace {

// A tile of a volume takes some hundredths of a second. Wide flat tiles waste less on margins.
constexpr int kVolumeTile = 32, kFlatTile = 128;

// The lattice family keeps means over 2^n texels and takes level n for footprints of 2^n / 0.75
// (docs/filtering.md). This radius uses one level; others would mix two at twice the cost.
float radius_of(solidtex_family family, int lod) {
  const float edge = static_cast<float>(1 << lod);
  return family == SOLIDTEX_FAMILY_FIELD ? edge * (2.0f / 3.0f) : edge / 2;
}

// From the engine's [x][y][z][channel] to [z][y][x][channel].
void transpose(const std::vector<float>& from, const Region& region, std::size_t channels,
               float* to) {
  const auto width = static_cast<std::size_t>(region.size(0));
  const auto height = static_cast<std::size_t>(region.size(1));
  const auto depth = static_cast<std::size_t>(region.size(2));
  for (std::size_t z = 0; z < depth; ++z)
    for (std::size_t y = 0; y < height; ++y)
      for (std::size_t x = 0; x < width; ++x) {
        to = std::copy_n(&from[((x * height + y) * depth + z) * channels], channels, to);
      }
}

}  // namespace

VolumeLevel::VolumeLevel(const Query& query, int lod)
    : lod_(lod), origin_(query.origin), scale_(query.scale.value_or(1)) {
  const bool is_flat = *std::min_element(query.size.begin(), query.size.end()) == 1;
  const int chosen = query.tile ? query.tile : is_flat ? kFlatTile : kVolumeTile;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    size_[axis] = ((query.size[axis] - 1) >> lod) + 1;
    // Coarser tiles have fewer voxels, since each costs more.
    tile_[axis] = size_[axis] > 1 ? std::max(chosen >> lod, kMinTile) : 1;
  }
}

std::array<float, 16> VolumeLevel::world_to_local() const {
  std::array<float, 16> matrix{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double texels = static_cast<double>(size_[axis]) * static_cast<double>(1 << lod_);
    matrix[axis * 5] = static_cast<float>(scale_ / texels);
    matrix[12 + axis] = static_cast<float>((0.0 - static_cast<double>(origin_[axis])) / texels);
  }
  matrix[15] = 1;
  return matrix;
}

void VolumeLevel::evaluate(const texture& texture, const Region& region, float* values) const {
  if (lod_ == 0) return evaluate_texels(texture, region, values);
  evaluate_means(texture, region, values);
}

void VolumeLevel::evaluate_texels(const texture& texture, const Region& region,
                                  float* values) const {
  std::array<std::int64_t, 3> low = origin_, size{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis] += region.low[axis];
    size[axis] = region.size(axis);
  }
  std::vector<float> found(region.voxel_count() * texture.channel_count());
  texture.eval_box(low, size, found);
  transpose(found, region, texture.channel_count(), values);
}

void VolumeLevel::evaluate_means(const texture& texture, const Region& region,
                                 float* values) const {
  const float edge = static_cast<float>(1 << lod_);
  std::array<double, 3> corner{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    corner[axis] = static_cast<double>(origin_[axis] + (std::int64_t{region.low[axis]} << lod_));
  }
  std::vector<float> centers;
  centers.reserve(3 * region.voxel_count());
  const auto center = [edge](int voxel) { return (static_cast<float>(voxel) + 0.5f) * edge; };
  for (int z = 0; z < region.size(2); ++z)
    for (int y = 0; y < region.size(1); ++y)
      for (int x = 0; x < region.size(0); ++x) {
        centers.insert(centers.end(), {center(x), center(y), center(z)});
      }
  const std::vector<float> radii(region.voxel_count(), radius_of(texture.family(), lod_));
  const std::span found(values, region.voxel_count() * texture.channel_count());
  texture.eval_filtered(corner, centers, radii, found);
}

}  // namespace solidtex::openimageio
