// Reflection of the two materials. Directions are in the local frame: z is the normal, both point
// away from the surface. Both materials are reciprocal and reflect no more than they receive.
#pragma once

#include <array>
#include <glm/glm.hpp>

namespace solidtex::pathtracer {

// A rough dielectric layer (GGX) over the diffuse base, with its directional albedo tabulated, so
// that the base receives exactly what the coat lets through.
class Coat {
 public:
  Coat(float roughness, float ior);
  // Between two coats of the same index, whose tables it mixes: (1 - t) smoother + t rougher.
  Coat(const Coat& smoother, const Coat& rougher, float t, float roughness);

  float alpha() const { return alpha_; }
  float ior() const { return ior_; }
  // Share of the light from a direction with this cosine that the coat reflects.
  float albedo(float cosine) const;
  float average_albedo() const { return average_; }
  // Share of the light coming up from the base that the coat sends back down.
  float internal_reflectance() const;

 private:
  static constexpr int kEntries = 128;
  float alpha_, ior_, average_ = 0;
  std::array<float, kEntries> table_{};
};

struct BsdfSample {
  glm::vec3 direction{0};
  glm::vec3 weight{0};  // BSDF times cosine over pdf
  float pdf = 0;        // 0: no light this way
  bool from_coat = false;
};

// What is left of a material at one point. `coat` is null for the diffuse one.
struct Bsdf {
  glm::vec3 albedo{0};
  const Coat* coat = nullptr;

  glm::vec3 eval(const glm::vec3& out, const glm::vec3& in) const;  // times cosine of `in`
  float pdf(const glm::vec3& out, const glm::vec3& in) const;
  BsdfSample sample(const glm::vec3& out, float lobe, const glm::vec2& u) const;

 private:
  float coat_probability(float cosine) const;
};

// Fresnel reflectance of unpolarised light from vacuum onto a dielectric.
float fresnel_dielectric(float cosine, float ior);

}  // namespace solidtex::pathtracer
