// Blends of solid textures over a surface.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/glm.hpp>
#include <solidtex/solidtex.hpp>

#include "plugins/pathtracer/geometry/interaction.h"
#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {

// Returns the place of a point on the walk, from 0 at the first texture to n - 1 at the last of n.
// `origin`: of the positions at which the mix's textures are evaluated.
float place_on_walk(const Scene& scene, const SolidColor& color, const glm::dvec3& origin,
                    const SurfaceInteraction& interaction);

// Share of texture k at a place: 1 at the texture itself, falling to 0 at its neighbors.
inline float share_at(float place, std::size_t k) {
  return std::max(0.0f, 1 - std::abs(place - static_cast<float>(k)));
}

// Restores the contrast that a weighted mean of independent textures loses: scales the deviation
// from the mean color (Heitz and Neyret, "High-performance by-example noise using a
// histogram-preserving blending operator", 2018).
glm::vec3 with_contrast(const Mix& mix, float place, const glm::vec3& color);

// Returns the mean albedo of a texture, linear.
glm::vec3 mean_albedo(const solidtex::texture& texture);

}  // namespace solidtex::pathtracer
