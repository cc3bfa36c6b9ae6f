// Directional albedo of single scattering at a rough interface, tabulated by roughness and cosine.
// Diffuse lobes compensate the missing energy (Kulla and Conty, "Revisiting Physically Based
// Shading at Imageworks", 2017).
#pragma once

#include <array>
#include <functional>
#include <glm/glm.hpp>

namespace solidtex::pathtracer {

// Roughness is clamped to this range. The minimum looks like a mirror and keeps densities finite.
inline constexpr float kMinRoughness = 0.02f, kMaxRoughness = 1;

class AlbedoTable {
 public:
  // Returns the scattered fraction, 0 to 1, of light from `out` at a facet with the normal h.
  using Scatter = std::function<float(const glm::vec3& out, const glm::vec3& h, float alpha)>;
  explicit AlbedoTable(const Scatter& scatter);

  // Arguments are from 0 to 1.
  float at(float roughness, float cosine) const;
  float average(float roughness) const;  // over the hemisphere, weighted by the cosine

  static const AlbedoTable& mirror();        // facets reflect all light
  static AlbedoTable reflection(float ior);  // dielectric facets, reflection only
  static AlbedoTable reflection_and_refraction(float ior);

 private:
  static constexpr std::size_t kRows = 33, kColumns = 64;  // roughness, square root of the cosine
  std::array<std::array<float, kColumns>, kRows> table_{};
  std::array<float, kRows> averages_{};
};

}  // namespace solidtex::pathtracer
