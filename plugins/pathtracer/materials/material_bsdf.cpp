#include "plugins/pathtracer/materials/material_bsdf.h"

#include <algorithm>

namespace solidtex::pathtracer {
namespace {

float share(float x) { return std::clamp(x, 0.0f, 1.0f); }

}  // namespace

MaterialBsdf::MaterialBsdf(const Material& material) : type_(material.type), coats_(material) {
  if (type_ == MaterialType::principled) {
    principled_ = std::make_shared<PrincipledBsdf::Tables>(material.ior);
  } else if (type_ == MaterialType::dielectric) {
    dielectric_ = std::make_shared<DielectricBsdf::Tables>(material.ior);
  }
}

Bsdf MaterialBsdf::at(const Appearance& appearance, bool inside, std::optional<Coat>& made) const {
  if (principled_) {
    return Bsdf(PrincipledBsdf({.color = appearance.color,
                                .roughness = appearance.roughness,
                                .metallic = share(appearance.metallic),
                                .specular = share(appearance.specular),
                                .coat = share(appearance.coat),
                                .coat_roughness = appearance.coat_roughness},
                               *principled_));
  }
  if (dielectric_) {
    return Bsdf(DielectricBsdf(appearance.color, appearance.roughness, inside, *dielectric_));
  }
  return Bsdf(CoatedBsdf{appearance.color, coats_.at(appearance.roughness, made)});
}

}  // namespace solidtex::pathtracer
