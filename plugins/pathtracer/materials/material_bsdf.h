// From what a material is at a point to how it scatters light there.
#pragma once

#include <memory>
#include <optional>

#include "plugins/pathtracer/materials/appearance.h"
#include "plugins/pathtracer/materials/bsdf.h"
#include "plugins/pathtracer/materials/coats.h"

namespace solidtex::pathtracer {

// Holds the tables that one material needs.
class MaterialBsdf {
 public:
  explicit MaterialBsdf(const Material& material);

  // `inside`: seen from within a solid, for refraction. `made` keeps a coat that is not tabulated;
  // the BSDF refers to it and to the tables.
  Bsdf at(const Appearance& appearance, bool inside, std::optional<Coat>& made) const;

 private:
  MaterialType type_;
  Coats coats_;
  std::shared_ptr<const PrincipledBsdf::Tables> principled_;
  std::shared_ptr<const DielectricBsdf::Tables> dielectric_;
};

}  // namespace solidtex::pathtracer
