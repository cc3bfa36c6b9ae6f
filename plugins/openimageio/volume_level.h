// A level of detail of a volume.
#pragma once

#include <array>
#include <cstdint>

#include "plugins/openimageio/level.h"
#include "plugins/openimageio/query.h"

namespace solidtex::openimageio {

// Level n has voxels with edges of 2^n texels. Level 0 has the voxels of the texture. Other levels
// have linear means over cubes, by solidtex_eval_filtered: where the origin is a multiple of 2^n,
// exact means up to n = 3 and predicted ones above. The texture continues beyond the image.
class VolumeLevel final : public Level {
 public:
  VolumeLevel(const Query& query, int lod);

  // Maps a point of the host's world to [0,1]^3 over the image; for row vectors, as in OpenImageIO.
  std::array<float, 16> world_to_local() const;

  void evaluate(const texture& texture, const Region& region, float* values) const override;

 private:
  void evaluate_texels(const texture& texture, const Region& region, float* values) const;
  void evaluate_means(const texture& texture, const Region& region, float* values) const;

  int lod_;
  std::array<std::int64_t, 3> origin_;
  double scale_;
};

}  // namespace solidtex::openimageio
