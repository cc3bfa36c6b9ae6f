#include "plugins/pathtracer/materials/mix.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "plugins/pathtracer/materials/textures.h"

namespace solidtex::pathtracer {
namespace {

double distance_to(const ShapeDistance& shape, const glm::dvec3& position) {
  const glm::dvec3 p(shape.to_shape * glm::dvec4(position, 1));
  switch (shape.shape) {
    case ShapeDistance::Shape::plane:
      return p.z;
    case ShapeDistance::Shape::sphere:
      return glm::length(p) - shape.size.x;
    case ShapeDistance::Shape::box:
      break;
  }
  const glm::dvec3 outside = glm::abs(p) - shape.size;
  return glm::length(glm::max(outside, 0.0)) +
         std::min(std::max({outside.x, outside.y, outside.z}), 0.0);
}

double number_at(const Scene& scene, const SolidColor& color, const glm::dvec3& origin,
                 const SurfaceInteraction& interaction) {
  const auto& by = color.mix->by;
  if (const auto* shape = std::get_if<ShapeDistance>(&by)) {
    const glm::vec3& p = color.world_space ? interaction.position : interaction.object_position;
    return distance_to(*shape, origin + glm::dvec3(p));
  }
  if (const auto* image = std::get_if<ImageChannel>(&by)) {
    return lookup_image(scene.images[image->image], interaction.uv)[image->channel];
  }
  return interaction.attribute;
}

}  // namespace

float place_on_walk(const Scene& scene, const SolidColor& color, const glm::dvec3& origin,
                    const SurfaceInteraction& interaction) {
  const Mix& mix = *color.mix;
  const double number = number_at(scene, color, origin, interaction);
  const double t = std::clamp((number - mix.range.x) / (mix.range.y - mix.range.x), 0.0, 1.0);
  return static_cast<float>(t * static_cast<double>(mix.textures.size() - 1));
}

glm::vec3 with_contrast(const Mix& mix, float place, const glm::vec3& color) {
  const auto first = std::min(static_cast<std::size_t>(place), mix.textures.size() - 2);
  const float a = share_at(place, first), b = share_at(place, first + 1);
  const glm::vec3 mean = a * mix.means[first] + b * mix.means[first + 1];
  return mean + (color - mean) / std::sqrt(a * a + b * b);
}

glm::vec3 mean_albedo(const solidtex::texture& texture) {
  const std::array<float, 3> point = {0, 0, 0};
  const std::array<float, 1> radius = {std::numeric_limits<float>::infinity()};
  std::vector<float> values(texture.channel_count());
  texture.eval_filtered({0, 0, 0}, point, radius, values);
  return Albedo(texture)(values.data());
}

}  // namespace solidtex::pathtracer
