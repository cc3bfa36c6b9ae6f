#include "plugins/pathtracer/texel_space.h"

#include <cmath>

namespace solidtex::pathtracer {

TexelSpace::TexelSpace(const SolidColor& color)
    : world_space_(color.world_space),
      linear_(color.to_texels),
      origin_(color.to_texels[3]),
      scale_(std::cbrt(std::abs(glm::determinant(linear_)))) {}

TexelSpace::Point TexelSpace::operator()(const Surface& surface) const {
  const glm::vec3& p = world_space_ ? surface.position : surface.object_position;
  const double units = world_space_ ? 1.0 : surface.object_scale;
  return {glm::vec3(linear_ * glm::dvec3(p)),
          static_cast<float>(surface.footprint * units * scale_)};
}

const SolidColor* solid_texture_of(const Material& material) {
  if (const auto* color = std::get_if<SolidColor>(&material.color)) return color;
  return material.channels_of ? &*material.channels_of : nullptr;
}

std::uint32_t texture_points_of(const Material& material) {
  if (!solid_texture_of(material)) return 0;
  return material.bump ? 5 : 1;
}

}  // namespace solidtex::pathtracer
