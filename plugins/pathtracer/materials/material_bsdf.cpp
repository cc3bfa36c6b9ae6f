#include "plugins/pathtracer/materials/material_bsdf.h"

#include <algorithm>

namespace solidtex::pathtracer {
namespace {

constexpr int kSteps = 32;  // of a coat table; neighbors differ little in albedo

float roughness_of(int index) {
  const float t = static_cast<float>(index) / kSteps;
  return kMinRoughness + t * (kMaxRoughness - kMinRoughness);
}

float saturate(float x) { return std::clamp(x, 0.0f, 1.0f); }

}  // namespace

CoatTable::CoatTable(const Material& material) {
  if (material.type != MaterialType::coated) return;
  if (const auto* roughness = std::get_if<float>(&material.roughness)) {
    coats_.emplace_back(std::max(*roughness, kMinRoughness), material.ior);
    return;
  }
  for (int i = 0; i <= kSteps; ++i) coats_.emplace_back(roughness_of(i), material.ior);
}

const Coat* CoatTable::at(float roughness, std::optional<Coat>& storage) const {
  if (coats_.empty()) return nullptr;
  if (coats_.size() == 1) return &coats_[0];
  roughness = std::clamp(roughness, kMinRoughness, kMaxRoughness);
  const float place = (roughness - kMinRoughness) / (kMaxRoughness - kMinRoughness) * kSteps;
  const int index = std::min(static_cast<int>(place), kSteps - 1);
  const auto i = static_cast<std::size_t>(index);
  storage.emplace(coats_[i], coats_[i + 1], place - static_cast<float>(index), roughness);
  return &*storage;
}

MaterialBsdf::MaterialBsdf(const Material& material) : type_(material.type), coats_(material) {
  if (type_ == MaterialType::principled) {
    principled_ = std::make_shared<PrincipledBsdf::Tables>(material.ior);
  } else if (type_ == MaterialType::dielectric) {
    dielectric_ = std::make_shared<DielectricBsdf::Tables>(material.ior);
  }
}

Bsdf MaterialBsdf::at(const MaterialSample& sample, bool inside,
                      std::optional<Coat>& coat_storage) const {
  if (principled_) {
    return Bsdf(PrincipledBsdf({.color = sample.color,
                                .roughness = sample.roughness,
                                .metallic = saturate(sample.metallic),
                                .specular = saturate(sample.specular),
                                .coat = saturate(sample.coat),
                                .coat_roughness = sample.coat_roughness},
                               *principled_));
  }
  if (dielectric_) {
    return Bsdf(DielectricBsdf(sample.color, sample.roughness, inside, *dielectric_));
  }
  return Bsdf(CoatedBsdf{sample.color, coats_.at(sample.roughness, coat_storage)});
}

}  // namespace solidtex::pathtracer
