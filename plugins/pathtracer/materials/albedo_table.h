// Directional albedo of a rough interface, tabulated by roughness and cosine: what single
// scattering keeps of the light. What it loses is given back by diffuse lobes (Kulla and Conty,
// "Revisiting Physically Based Shading at Imageworks", 2017).
#pragma once

#include <array>
#include <functional>
#include <glm/glm.hpp>

namespace solidtex::pathtracer {

// Roughness below this is taken for this: a mirror to the eye, and still finite.
inline constexpr float kMinRoughness = 0.02f, kMaxRoughness = 1;

class AlbedoTable {
 public:
  // What is left of light from `out` that met a facet with the normal h, 0 to 1.
  using Scatter = std::function<float(const glm::vec3& out, const glm::vec3& h, float alpha)>;
  explicit AlbedoTable(const Scatter& scatter);

  // Both from 0 to 1.
  float at(float roughness, float cosine) const;
  float average(float roughness) const;  // over the hemisphere, weighted by the cosine

  // Facets that reflect all light; dielectric ones of this index; ones that also let light through.
  static const AlbedoTable& mirror();
  static AlbedoTable reflection(float ior);
  static AlbedoTable reflection_and_refraction(float ior);

 private:
  static constexpr std::size_t kRows = 33, kColumns = 64;  // roughness, root of the cosine
  std::array<std::array<float, kColumns>, kRows> table_{};
  std::array<float, kRows> averages_{};
};

}  // namespace solidtex::pathtracer
