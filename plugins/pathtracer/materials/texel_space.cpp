#include "plugins/pathtracer/materials/texel_space.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "plugins/pathtracer/sampling/sampling.h"

namespace solidtex::pathtracer {

TexelSpace::TexelSpace(const SolidColor& color, const glm::dvec3& origin)
    : world_space_(color.world_space),
      linear_(color.to_texels),
      origin_(linear_ * origin + glm::dvec3(color.to_texels[3])),
      scale_(std::cbrt(std::abs(glm::determinant(linear_)))) {}

TexelSpace::Point TexelSpace::operator()(const SurfaceInteraction& interaction) const {
  const glm::vec3& p = world_space_ ? interaction.position : interaction.object_position;
  const double units = world_space_ ? 1.0 : interaction.object_scale;
  return {glm::vec3(linear_ * glm::dvec3(p)),
          static_cast<float>(interaction.footprint * units * scale_)};
}

glm::dvec3 position_origin(const Scene& scene, const SolidColor& color, std::uint32_t object) {
  return color.world_space ? scene.origin : scene.meshes[scene.objects[object].mesh].origin;
}

std::array<glm::vec3, 2> footprint_axes(const SurfaceInteraction& interaction,
                                        const glm::mat3& world_to_texels) {
  const glm::vec3& normal = interaction.geometric_normal;
  const float cosine = std::max(-glm::dot(normal, interaction.view), kMinCosine);
  const float radius = interaction.footprint * std::sqrt(cosine);  // of the cone
  const glm::vec3 along = interaction.view - glm::dot(normal, interaction.view) * normal;
  const float sine = glm::length(along);
  // At normal incidence any direction is valid.
  const glm::vec3 major = sine > 1e-4f ? along / sine : Frame(normal).x;
  return {world_to_texels * (radius / cosine * major),
          world_to_texels * (radius * glm::cross(normal, major))};
}

const SolidColor* solid_texture_of(const Material& material) {
  if (const auto* color = std::get_if<SolidColor>(&material.color)) return color;
  return material.channels_of ? &*material.channels_of : nullptr;
}

SolidColor* solid_texture_of(Material& material) {
  return const_cast<SolidColor*>(solid_texture_of(std::as_const(material)));
}

}  // namespace solidtex::pathtracer
