#include "plugins/pathtracer/materials/appearance.h"

#include <array>
#include <iterator>

#include "plugins/pathtracer/materials/texel_space.h"
#include "plugins/pathtracer/materials/textures.h"
#include "plugins/pathtracer/sampling/sampling.h"

namespace solidtex::pathtracer {
namespace {

constexpr float kLeastRadius = 0.25f, kLeastAxis = 0.5f;  // texels
constexpr float kLeastStep = 0.5f;  // texels to a bump's neighbours; their values are a texel wide

constexpr float Appearance::*kTargets[] = {&Appearance::roughness, &Appearance::metallic,
                                           &Appearance::specular, &Appearance::coat,
                                           &Appearance::coat_roughness};
static_assert(std::size(kTargets) == std::size(kInputs));  // in the same order

glm::vec3 clamp_albedo(const glm::vec3& color) {
  return glm::clamp(color, 0.0f, kMaxTextureAlbedo);
}

// Of directions.
glm::mat3 scene_to_texels(const SolidColor& solid, const Object& object) {
  const glm::mat3 to_texels(solid.to_texels);
  return solid.world_space ? to_texels : to_texels * glm::inverse(glm::mat3(object.to_world));
}

}  // namespace

glm::vec3 bumped_normal(const glm::vec3& normal, const glm::vec2& slope, const glm::vec3& view) {
  if (slope == glm::vec2(0)) return normal;
  constexpr float kLeastCosine = 0.01f;
  const glm::vec3 bumped = glm::normalize(Frame(normal).to_world({-slope.x, -slope.y, 1}));
  const float cosine = glm::dot(bumped, view);
  if (cosine >= kLeastCosine) return bumped;
  return glm::normalize(bumped + (kLeastCosine - cosine) * view);
}

AppearanceLookup::Source::Source(const Scene& scene, const Material& material) {
  solid = std::get_if<SolidColor>(&material.color);
  solid_color = solid != nullptr;
  if (const auto* color = std::get_if<glm::vec3>(&material.color)) constant.color = *color;
  if (const auto* image = std::get_if<ImageColor>(&material.color)) {
    color_image = &scene.images[image->image];
  }
  for (std::size_t i = 0; i < std::size(kInputs); ++i) {
    const Input& input = material.*kInputs[i];
    const auto target = kTargets[i];
    if (const auto* number = std::get_if<float>(&input)) constant.*target = *number;
    if (const auto* image = std::get_if<ImageChannel>(&input)) images.emplace_back(target, *image);
    if (const auto* channel = std::get_if<SolidChannel>(&input)) {
      channels.emplace_back(target, channel->channel);
    }
  }
  bump = material.bump;
  if (!solid && (bump || !channels.empty())) solid = &*material.channels_of;
  if (!solid) return;
  texture = &scene.textures[solid->texture];
  encoded = texture->color_space() == "srgb";
  if (solid_color) albedo = albedo_channels(*texture);
}

AppearanceLookup::AppearanceLookup(const Scene& scene, TextureFilter filter)
    : scene_(scene), filter_(filter) {
  for (const Material& material : scene.materials) sources_.emplace_back(scene, material);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Object& object = scene.objects[i];
    const Source& source = sources_[object.material];
    const bool has_axes = source.solid && filter == TextureFilter::anisotropic;
    if (!source.bump && !has_axes) continue;
    scene_to_texels_.resize(scene.objects.size());
    scene_to_texels_[i] = scene_to_texels(*source.solid, object);
  }
}

std::size_t AppearanceLookup::operator()(std::span<const Surface> surfaces,
                                         std::span<Appearance> found) {
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    Source& source = sources_[surfaces[i].material];
    found[i] = source.constant;
    look_up_images(source, surfaces[i], found[i]);
    if (source.solid) source.waiting.push_back(static_cast<std::uint32_t>(i));
  }
  std::size_t point_count = 0;
  for (Source& source : sources_) {
    if (source.waiting.empty()) continue;
    query(source, surfaces, found);
    point_count += radii_.size();
    source.waiting.clear();
  }
  return point_count;
}

void AppearanceLookup::look_up_images(const Source& source, const Surface& surface,
                                      Appearance& found) const {
  if (source.color_image) found.color = clamp_albedo(lookup_image(*source.color_image, surface.uv));
  for (const auto& [target, image] : source.images) {
    found.*target = lookup_image(scene_.images[image.image], surface.uv)[image.channel];
  }
}

// In texels. What is far smaller than a texel is a point, which is cheaper to look up.
float AppearanceLookup::filter_radius(float footprint) const {
  return filter_ == TextureFilter::none || footprint < kLeastRadius ? 0 : footprint;
}

// Relative to the origin of the texture's space.
void AppearanceLookup::place_points(const Source& source, std::span<const Surface> surfaces) {
  const TexelSpace space(*source.solid);
  points_.clear();
  radii_.clear();
  axes_.clear();
  steps_.clear();
  for (const std::uint32_t i : source.waiting) {
    const Surface& surface = surfaces[i];
    TexelSpace::Point point = space(surface);
    const float radius = filter_radius(point.radius);
    if (filter_ == TextureFilter::stochastic) point.offset += radius * surface.jitter;
    points_.insert(points_.end(), {point.offset.x, point.offset.y, point.offset.z});
    radii_.push_back(radius);
    if (source.bump) place_neighbours(surface, point.offset, radius);
    if (filter_ == TextureFilter::anisotropic) append_axes(source, surface);
  }
}

// Of a point and of a bump's neighbours.
void AppearanceLookup::append_axes(const Source& source, const Surface& surface) {
  auto [a, b] = footprint_axes(surface, scene_to_texels_[surface.object]);
  if (glm::length(a) < kLeastAxis) a = b = glm::vec3(0);
  for (int point = 0; point < (source.bump ? 5 : 1); ++point)
    axes_.insert(axes_.end(), {a.x, a.y, a.z, b.x, b.y, b.z, 0, 0, 0});
}

// To both sides along x and y of the normal's frame, as far as the footprint reaches: differences
// along the normal would not change the slope.
void AppearanceLookup::place_neighbours(const Surface& surface, const glm::vec3& texels,
                                        float radius) {
  const glm::mat3& to_texels = scene_to_texels_[surface.object];
  const Frame frame(surface.normal);
  for (const glm::vec3& axis : {frame.x, frame.y}) {
    const glm::vec3 texels_per_unit = to_texels * axis;
    const float step = std::max(radius, kLeastStep) / glm::length(texels_per_unit);
    steps_.push_back(step);
    for (const float side : {-step, step}) {
      const glm::vec3 point = texels + side * texels_per_unit;
      points_.insert(points_.end(), {point.x, point.y, point.z});
      radii_.push_back(radius);
    }
  }
}

void AppearanceLookup::query(const Source& source, std::span<const Surface> surfaces,
                             std::span<Appearance> found) {
  place_points(source, surfaces);
  const std::size_t channel_count = source.texture->channel_count();
  values_.resize(radii_.size() * channel_count);
  const glm::dvec3 place = TexelSpace(*source.solid).origin();
  const std::array<double, 3> origin = {place.x, place.y, place.z};
  switch (filter_) {
    case TextureFilter::footprint:
      source.texture->eval_filtered(origin, points_, radii_, values_);
      break;
    case TextureFilter::anisotropic:
      source.texture->eval_footprints(origin, points_, axes_, values_);
      break;
    case TextureFilter::stochastic:
    case TextureFilter::none:
      source.texture->eval_points(origin, points_, values_);
      break;
  }

  const float* value = values_.data();
  const float* step = steps_.data();
  for (const std::uint32_t i : source.waiting) {
    if (source.solid_color) {
      const glm::uvec3 c = source.albedo;
      const glm::vec3 albedo =
          glm::clamp(glm::vec3(value[c.x], value[c.y], value[c.z]), 0.0f, 1.0f);
      found[i].color = clamp_albedo(source.encoded ? srgb_to_linear(albedo) : albedo);
    }
    for (const auto& [target, channel] : source.channels) found[i].*target = value[channel];
    value += channel_count;
    if (!source.bump) continue;
    for (int axis = 0; axis < 2; ++axis, value += 2 * channel_count, ++step) {
      const std::size_t height = source.bump->channel;
      found[i].slope[axis] =
          source.bump->depth * (value[channel_count + height] - value[height]) / (2 * *step);
    }
  }
}

}  // namespace solidtex::pathtracer
