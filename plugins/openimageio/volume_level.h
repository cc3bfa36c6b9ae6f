// A level of detail of a volume.
#pragma once

#include <array>
#include <cstdint>

#include "plugins/openimageio/level.h"
#include "plugins/openimageio/query.h"

namespace solidtex::openimageio {

// Level n has voxels of 2^n texels along an edge. Those of level 0 are the texture's own. Others
// are means over their cubes, in light, as far as solidtex_eval_filtered knows them: where the
// origin is a multiple of 2^n these are the engine's own means up to n = 3, and above it what it
// predicts. Beyond the image the texture goes on.
class VolumeLevel final : public Level {
 public:
  VolumeLevel(const Query& query, int lod);

  // Row vectors: a point of the host's world to [0,1]^3 over the image, as OpenImageIO wants it.
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
