// The scene of the preview: a unit cube whose nearest octant is cut out, on a floor, lit by a soft
// sun and an even sky.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>

namespace solidtex::tools {

struct Ray {
  glm::dvec3 origin, direction;
};

struct Hit {
  glm::dvec3 point, normal;
};

// The first hit of the cube [0, 1]^3 without (0.5, 1]^3.
std::optional<Hit> intersect_cut_cube(const Ray& ray);

// A low-discrepancy sequence in the unit square, shifted by a hash of the pixel. The same seed
// gives the same points.
class SampleSequence {
 public:
  explicit SampleSequence(std::uint32_t pixel);
  glm::dvec2 next();

 private:
  glm::dvec2 point_;
};

// Light that arrives at a surface point: 1 on an unshaded surface that faces up.
double irradiance(const glm::dvec3& point, const glm::dvec3& normal, SampleSequence& samples);

// Linear gray of the unshaded floor and of the backdrop.
inline constexpr double backdrop = 0.62;

// The camera ray through (x, y) of the image plane, each in [0, 1] from the top left.
Ray camera_ray(double x, double y);

}  // namespace solidtex::tools
