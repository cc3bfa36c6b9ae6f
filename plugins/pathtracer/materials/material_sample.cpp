#include "plugins/pathtracer/materials/material_sample.h"

#include <array>
#include <iterator>

#include "plugins/pathtracer/materials/mix.h"
#include "plugins/pathtracer/materials/texel_space.h"
#include "plugins/pathtracer/sampling/sampling.h"

namespace solidtex::pathtracer {
namespace {

constexpr float kMinRadius = 0.25f, kMinAxis = 0.5f;  // texels
constexpr float kMinStep = 0.5f;  // texels to a bump's neighbors; voxels are one texel wide

constexpr float MaterialSample::*kOutputs[] = {
    &MaterialSample::roughness, &MaterialSample::metallic, &MaterialSample::specular,
    &MaterialSample::coat, &MaterialSample::coat_roughness};
static_assert(std::size(kOutputs) == std::size(kInputs));  // in the same order

glm::vec3 clamp_albedo(const glm::vec3& color) {
  return glm::clamp(color, 0.0f, kMaxTextureAlbedo);
}

// Maps directions.
glm::mat3 world_to_texels(const SolidColor& solid, const Object& object) {
  const glm::mat3 to_texels(solid.to_texels);
  return solid.world_space ? to_texels : to_texels * glm::inverse(glm::mat3(object.to_world));
}

}  // namespace

glm::vec3 bumped_normal(const glm::vec3& normal, const glm::vec2& height_gradient,
                        const glm::vec3& view) {
  if (height_gradient == glm::vec2(0)) return normal;
  constexpr float kMinCosine = 0.01f;
  const glm::vec3 bumped =
      glm::normalize(Frame(normal).to_world({-height_gradient.x, -height_gradient.y, 1}));
  const float cosine = glm::dot(bumped, view);
  if (cosine >= kMinCosine) return bumped;
  return glm::normalize(bumped + (kMinCosine - cosine) * view);
}

MaterialEvaluator::Source::Source(const Scene& scene, const Material& material,
                                  const glm::dvec3& texture_origin)
    : origin(texture_origin) {
  solid = std::get_if<SolidColor>(&material.color);
  if (const auto* color = std::get_if<glm::vec3>(&material.color)) constant.color = *color;
  if (const auto* image = std::get_if<ImageColor>(&material.color)) {
    color_image = &scene.images[image->image];
  }
  for (std::size_t i = 0; i < std::size(kInputs); ++i) {
    const Input& input = material.*kInputs[i];
    const auto target = kOutputs[i];
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
  if (std::holds_alternative<SolidColor>(material.color)) albedo.emplace(*texture);
}

MaterialEvaluator::MaterialEvaluator(const Scene& scene, TextureFilter filter)
    : scene_(scene), filter_(filter) {
  for (const Material& material : scene.materials) {
    sources_.emplace_back(scene, material, glm::dvec3(0));
  }
  for (std::uint32_t i = 0; i < scene.objects.size(); ++i) {
    const Material& material = scene.materials[scene.objects[i].material];
    const SolidColor* solid = solid_texture_of(material);
    const glm::dvec3 origin = solid ? position_origin(scene, *solid, i) : glm::dvec3(0);
    if (origin == glm::dvec3(0)) continue;
    if (object_sources_.empty()) {
      for (const Object& object : scene.objects) {
        object_sources_.push_back(static_cast<std::uint32_t>(object.material));
      }
    }
    object_sources_[i] = static_cast<std::uint32_t>(sources_.size());
    sources_.emplace_back(scene, material, origin);
  }
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Object& object = scene.objects[i];
    const Source& source = sources_[object.material];
    const bool has_axes = source.solid && filter == TextureFilter::anisotropic;
    if (!source.bump && !has_axes) continue;
    world_to_texels_.resize(scene.objects.size());
    world_to_texels_[i] = world_to_texels(*source.solid, object);
  }
}

MaterialEvaluator::Source& MaterialEvaluator::source_of(const SurfaceInteraction& interaction) {
  return sources_[object_sources_.empty() ? interaction.material
                                          : object_sources_[interaction.object]];
}

std::size_t MaterialEvaluator::operator()(std::span<const SurfaceInteraction> interactions,
                                          std::span<MaterialSample> samples) {
  for (std::size_t i = 0; i < interactions.size(); ++i) {
    Source& source = source_of(interactions[i]);
    samples[i] = source.constant;
    look_up_images(source, interactions[i], samples[i]);
    if (source.solid) source.pending.push_back(static_cast<std::uint32_t>(i));
  }
  std::size_t point_count = 0;
  for (Source& source : sources_) {
    if (source.pending.empty()) continue;
    if (source.solid->mix) {
      query_mix(source, interactions, samples);
    } else {
      query(source, interactions, samples);
    }
    for (const std::uint32_t i : source.pending) point_count += samples[i].texture_points;
    source.pending.clear();
  }
  return point_count;
}

void MaterialEvaluator::look_up_images(const Source& source, const SurfaceInteraction& interaction,
                                       MaterialSample& sample) const {
  if (source.color_image)
    sample.color = clamp_albedo(lookup_image(*source.color_image, interaction.uv));
  for (const auto& [target, image] : source.images) {
    sample.*target = lookup_image(scene_.images[image.image], interaction.uv)[image.channel];
  }
}

// In texels. A footprint far smaller than a texel becomes a point, which is cheaper to evaluate.
float MaterialEvaluator::filter_radius(float footprint) const {
  return filter_ == TextureFilter::none || footprint < kMinRadius ? 0 : footprint;
}

// Points are relative to the origin of the texel space.
void MaterialEvaluator::place_points(const Source& source, std::span<const std::uint32_t> indices,
                                     std::span<const SurfaceInteraction> interactions) {
  const TexelSpace space(*source.solid, source.origin);
  points_.clear();
  radii_.clear();
  axes_.clear();
  steps_.clear();
  for (const std::uint32_t i : indices) {
    const SurfaceInteraction& interaction = interactions[i];
    TexelSpace::Point point = space(interaction);
    const float radius = filter_radius(point.radius);
    if (filter_ == TextureFilter::stochastic) point.offset += radius * interaction.jitter;
    points_.insert(points_.end(), {point.offset.x, point.offset.y, point.offset.z});
    radii_.push_back(radius);
    if (source.bump) place_neighbors(interaction, point.offset, radius);
    if (filter_ == TextureFilter::anisotropic) append_axes(source, interaction);
  }
}

// Appends the axes of a point and of its bump's neighbors.
void MaterialEvaluator::append_axes(const Source& source, const SurfaceInteraction& interaction) {
  auto [a, b] = footprint_axes(interaction, world_to_texels_[interaction.object]);
  if (glm::length(a) < kMinAxis) a = b = glm::vec3(0);
  for (int point = 0; point < (source.bump ? 5 : 1); ++point)
    axes_.insert(axes_.end(), {a.x, a.y, a.z, b.x, b.y, b.z, 0, 0, 0});
}

// Central differences along x and y of the normal's frame, a footprint apart. Differences along the
// normal do not change the gradient.
void MaterialEvaluator::place_neighbors(const SurfaceInteraction& interaction,
                                        const glm::vec3& texels, float radius) {
  const glm::mat3& to_texels = world_to_texels_[interaction.object];
  const Frame frame(interaction.normal);
  for (const glm::vec3& axis : {frame.x, frame.y}) {
    const glm::vec3 texels_per_unit = to_texels * axis;
    const float step = std::max(radius, kMinStep) / glm::length(texels_per_unit);
    steps_.push_back(step);
    for (const float side : {-step, step}) {
      const glm::vec3 point = texels + side * texels_per_unit;
      points_.insert(points_.end(), {point.x, point.y, point.z});
      radii_.push_back(radius);
    }
  }
}

void MaterialEvaluator::evaluate(const Source& source, const solidtex::texture& texture,
                                 std::span<const std::uint32_t> indices,
                                 std::span<const SurfaceInteraction> interactions) {
  place_points(source, indices, interactions);
  values_.resize(radii_.size() * texture.channel_count());
  const glm::dvec3 place = TexelSpace(*source.solid, source.origin).origin();
  const std::array<double, 3> origin = {place.x, place.y, place.z};
  switch (filter_) {
    case TextureFilter::footprint:
      texture.eval_filtered(origin, points_, radii_, values_);
      break;
    case TextureFilter::anisotropic:
      texture.eval_footprints(origin, points_, axes_, values_);
      break;
    case TextureFilter::stochastic:
    case TextureFilter::none:
      texture.eval_points(origin, points_, values_);
      break;
  }
}

// Evaluates each texture of the mix at the points between its neighbors.
void MaterialEvaluator::query_mix(const Source& source,
                                  std::span<const SurfaceInteraction> interactions,
                                  std::span<MaterialSample> samples) {
  const Mix& mix = *source.solid->mix;
  places_.resize(interactions.size());
  for (const std::uint32_t i : source.pending) {
    places_[i] = place_on_walk(scene_, *source.solid, source.origin, interactions[i]);
  }
  for (std::size_t k = 0; k < mix.textures.size(); ++k) {
    selected_.clear();
    for (const std::uint32_t i : source.pending) {
      if (share_at(places_[i], k) > 0) selected_.push_back(i);
    }
    if (selected_.empty()) continue;
    const solidtex::texture& texture = scene_.textures[mix.textures[k]];
    evaluate(source, texture, selected_, interactions);
    const Albedo albedo(texture);
    const float* value = values_.data();
    for (const std::uint32_t i : selected_) {
      samples[i].color += share_at(places_[i], k) * albedo(value);
      ++samples[i].texture_points;
      value += texture.channel_count();
    }
  }
  for (const std::uint32_t i : source.pending) {
    glm::vec3& color = samples[i].color;
    const bool is_blend = samples[i].texture_points > 1;
    if (is_blend && !mix.means.empty()) color = with_contrast(mix, places_[i], color);
    color = clamp_albedo(color);
  }
}

void MaterialEvaluator::query(const Source& source,
                              std::span<const SurfaceInteraction> interactions,
                              std::span<MaterialSample> samples) {
  evaluate(source, *source.texture, source.pending, interactions);
  const std::size_t channel_count = source.texture->channel_count();
  const float* value = values_.data();
  const float* step = steps_.data();
  for (const std::uint32_t i : source.pending) {
    if (source.albedo) samples[i].color = clamp_albedo((*source.albedo)(value));
    samples[i].texture_points = source.bump ? 5 : 1;
    for (const auto& [target, channel] : source.channels) samples[i].*target = value[channel];
    value += channel_count;
    if (!source.bump) continue;
    for (int axis = 0; axis < 2; ++axis, value += 2 * channel_count, ++step) {
      const std::size_t height = source.bump->channel;
      samples[i].height_gradient[axis] =
          source.bump->depth * (value[channel_count + height] - value[height]) / (2 * *step);
    }
  }
}

}  // namespace solidtex::pathtracer
