// Creates the BSDF at a shading point from a material sample.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "plugins/pathtracer/materials/bsdf.h"
#include "plugins/pathtracer/materials/material_sample.h"

namespace solidtex::pathtracer {

// The coats of a material: one, or a table by roughness where the roughness is textured.
class CoatTable {
 public:
  explicit CoatTable(const Material& material);

  // Returns the coat for a roughness, null for a diffuse material. A coat between two table entries
  // is created in `storage`.
  const Coat* at(float roughness, std::optional<Coat>& storage) const;

 private:
  std::vector<Coat> coats_;  // none, one, or by increasing roughness
};

// Holds the tables of one material.
class MaterialBsdf {
 public:
  explicit MaterialBsdf(const Material& material);

  // `inside`: the viewer is inside the solid, for refraction. The BSDF refers to the tables and to
  // `coat_storage`.
  Bsdf at(const MaterialSample& sample, bool inside, std::optional<Coat>& coat_storage) const;

 private:
  MaterialType type_;
  CoatTable coats_;
  std::shared_ptr<const PrincipledBsdf::Tables> principled_;
  std::shared_ptr<const DielectricBsdf::Tables> dielectric_;
};

}  // namespace solidtex::pathtracer
