// Footprints with three axes and their division into parts.
#pragma once

#include <array>
#include <cstddef>

namespace solidtex::engine {

// The points u a + v b + w c around a center, with u, v, w in [-1, 1]: a parallelepiped, a
// parallelogram if one axis is zero, a line if two are.
struct Axes {
  using Axis = std::array<double, 3>;
  std::array<Axis, 3> axis{};  // a, b, c: half edges in texels

  static Axes of(const float* nine);  // a, b, c, each as x, y, z
  static Axes cube(float radius);

  bool is_point() const;
  // Returns whether an axis has kEndless texels or more: the value is then the mean of the
  // material.
  bool is_endless() const;
  // Returns the radius of a cube with edges along x, y and z in this order, otherwise 0.
  float cube_radius() const;
};

inline constexpr double kEndless = 4096;

// A footprint divided into equal parts: count[i] along axis i.
struct Parts {
  Axes axes;  // of each part
  std::array<int, 3> count = {1, 1, 1};
  double reach = 0;  // half the longest edge of a part

  int total() const { return count[0] * count[1] * count[2]; }
};

// Divides a footprint along its longer axes into at most `max_parts` parts, the longest edges
// first, until parts are cubes or have a reach of `min_reach`. Cubes and endless footprints stay
// whole.
Parts cut(const Axes& axes, int max_parts, double min_reach);

// Calls use(step) for the center of each part, relative to the center of the footprint.
template <class Use>
void for_each_middle(const Parts& parts, const Use& use) {
  const auto& [a, b, c] = parts.axes.axis;
  for (int u = 1 - parts.count[0]; u < parts.count[0]; u += 2)
    for (int v = 1 - parts.count[1]; v < parts.count[1]; v += 2)
      for (int w = 1 - parts.count[2]; w < parts.count[2]; w += 2) {
        Axes::Axis step{};
        // A single part takes no step: zero times infinity is NaN.
        if (parts.total() > 1) {
          for (std::size_t k = 0; k < 3; ++k) step[k] = u * a[k] + v * b[k] + w * c[k];
        }
        use(step);
      }
}

}  // namespace solidtex::engine
