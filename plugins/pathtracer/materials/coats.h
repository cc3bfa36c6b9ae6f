// The coats of one material: one, or many where its roughness varies from point to point.
#pragma once

#include <optional>
#include <vector>

#include "plugins/pathtracer/materials/bsdf_coated.h"
#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {

class Coats {
 public:
  explicit Coats(const Material& material);

  // The coat where the surface is this rough, null for a diffuse material. `made` keeps it when it
  // lies between two that are tabulated.
  const Coat* at(float roughness, std::optional<Coat>& made) const;

 private:
  std::vector<Coat> coats_;  // none, one, or from the smoothest to the roughest
};

}  // namespace solidtex::pathtracer
