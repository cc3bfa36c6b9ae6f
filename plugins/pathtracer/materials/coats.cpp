#include "plugins/pathtracer/materials/coats.h"

#include <algorithm>

#include "plugins/pathtracer/materials/albedo_table.h"

namespace solidtex::pathtracer {
namespace {

constexpr int kSteps = 32;  // between tabulated coats; their albedo differs little from one to next

float roughness_of(int index) {
  const float t = static_cast<float>(index) / kSteps;
  return kMinRoughness + t * (kMaxRoughness - kMinRoughness);
}

}  // namespace

Coats::Coats(const Material& material) {
  if (material.type != MaterialType::coated) return;
  if (const auto* roughness = std::get_if<float>(&material.roughness)) {
    coats_.emplace_back(std::max(*roughness, kMinRoughness), material.ior);
    return;
  }
  for (int i = 0; i <= kSteps; ++i) coats_.emplace_back(roughness_of(i), material.ior);
}

const Coat* Coats::at(float roughness, std::optional<Coat>& made) const {
  if (coats_.empty()) return nullptr;
  if (coats_.size() == 1) return &coats_[0];
  roughness = std::clamp(roughness, kMinRoughness, kMaxRoughness);
  const float place = (roughness - kMinRoughness) / (kMaxRoughness - kMinRoughness) * kSteps;
  const int index = std::min(static_cast<int>(place), kSteps - 1);
  const auto i = static_cast<std::size_t>(index);
  made.emplace(coats_[i], coats_[i + 1], place - static_cast<float>(index), roughness);
  return &*made;
}

}  // namespace solidtex::pathtracer
