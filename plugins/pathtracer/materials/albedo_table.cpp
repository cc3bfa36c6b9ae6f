#include "plugins/pathtracer/materials/albedo_table.h"

#include "plugins/pathtracer/materials/microfacet.h"

namespace solidtex::pathtracer {
namespace {

// Fraction of the facets visible from `out` that `in` sees, too.
float visible_to_both(const glm::vec3& out, const glm::vec3& in, float alpha) {
  return masking_shadowing(out, in, alpha) / masking(out, alpha);
}

// Mean over a stratified grid of visible normals.
float integrate(const AlbedoTable::Scatter& scatter, float cosine, float alpha) {
  constexpr int kGrid = 24;
  const glm::vec3 out(std::sqrt(1 - cosine * cosine), 0, cosine);
  float sum = 0;
  for (int i = 0; i < kGrid; ++i) {
    for (int j = 0; j < kGrid; ++j) {
      const glm::vec2 u((static_cast<float>(i) + 0.5f) / kGrid,
                        (static_cast<float>(j) + 0.5f) / kGrid);
      sum += scatter(out, sample_visible_normal(out, alpha, u), alpha);
    }
  }
  return sum / (kGrid * kGrid);
}

struct Place {
  std::size_t index;
  float t;
};
Place find(float x, std::size_t count) {
  const float place = std::clamp(x, 0.0f, 1.0f) * static_cast<float>(count - 1);
  const auto index = std::min(static_cast<std::size_t>(place), count - 2);
  return {index, place - static_cast<float>(index)};
}

Place find_roughness(float roughness, std::size_t count) {
  return find((roughness - kMinRoughness) / (kMaxRoughness - kMinRoughness), count);
}

}  // namespace

AlbedoTable::AlbedoTable(const Scatter& scatter) {
  for (std::size_t row = 0; row < kRows; ++row) {
    const float t = static_cast<float>(row) / (kRows - 1);
    const float roughness = kMinRoughness + t * (kMaxRoughness - kMinRoughness);
    for (std::size_t column = 0; column < kColumns; ++column) {
      const float root = std::max(static_cast<float>(column) / (kColumns - 1), 0.01f);
      table_[row][column] = integrate(scatter, root * root, alpha_of(roughness));
    }
    // 2 cos d(cos) = 4 root^3 d(root).
    constexpr int kSteps = 1024;
    for (int i = 0; i < kSteps; ++i) {
      const float root = (static_cast<float>(i) + 0.5f) / kSteps;
      averages_[row] += at(roughness, root * root) * 4 * root * root * root / kSteps;
    }
  }
}

float AlbedoTable::at(float roughness, float cosine) const {
  const Place row = find_roughness(roughness, kRows);
  const Place column = find(std::sqrt(std::max(cosine, 0.0f)), kColumns);
  const auto& a = table_[row.index];
  const auto& b = table_[row.index + 1];
  const float low = a[column.index] + column.t * (a[column.index + 1] - a[column.index]);
  const float high = b[column.index] + column.t * (b[column.index + 1] - b[column.index]);
  return low + row.t * (high - low);
}

float AlbedoTable::average(float roughness) const {
  const Place row = find_roughness(roughness, kRows);
  return averages_[row.index] + row.t * (averages_[row.index + 1] - averages_[row.index]);
}

const AlbedoTable& AlbedoTable::mirror() {
  static const AlbedoTable table([](const glm::vec3& out, const glm::vec3& h, float alpha) {
    const glm::vec3 in = glm::reflect(-out, h);
    return in.z > 0 ? visible_to_both(out, in, alpha) : 0;
  });
  return table;
}

AlbedoTable AlbedoTable::reflection(float ior) {
  return AlbedoTable([ior](const glm::vec3& out, const glm::vec3& h, float alpha) {
    const glm::vec3 in = glm::reflect(-out, h);
    return in.z > 0 ? fresnel_dielectric(glm::dot(out, h), ior) * visible_to_both(out, in, alpha)
                    : 0;
  });
}

AlbedoTable AlbedoTable::reflection_and_refraction(float ior) {
  return AlbedoTable([ior](const glm::vec3& out, const glm::vec3& h, float alpha) {
    const float fresnel = fresnel_dielectric(glm::dot(out, h), ior);
    const glm::vec3 reflected = glm::reflect(-out, h), refracted = glm::refract(-out, h, 1 / ior);
    const float back = reflected.z > 0 ? fresnel * visible_to_both(out, reflected, alpha) : 0;
    const float through = refracted.z < 0 ? (1 - fresnel) * masking(refracted, alpha) : 0;
    return back + through;
  });
}

}  // namespace solidtex::pathtracer
