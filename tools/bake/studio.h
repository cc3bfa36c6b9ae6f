// The light around the cut cube: a soft sun, an even sky, a neutral floor that takes shadows.
#pragma once

#include <cstdint>

#include "tools/bake/cut_cube.h"

namespace solidtex::tools {

// A low-discrepancy sequence in the unit square, shifted by a hash of the pixel so that neighbours
// differ; the same every time.
class Samples {
 public:
  explicit Samples(std::uint32_t pixel);
  struct Pair {
    double u, v;
  };
  Pair next();

 private:
  double u_, v_;
};

// Light that arrives at a surface point, 1 where nothing shades it and it faces up.
double irradiance(const Vec3& point, const Vec3& normal, Samples& samples);

// Linear grey of floor and backdrop where nothing shades it.
inline constexpr double backdrop = 0.62;

// Ray from the camera through (x, y) of the image plane, each in [0, 1] from the top left.
Ray camera_ray(double x, double y);

}  // namespace solidtex::tools
