// Footprints with three axes, and the parts that they are looked up in.
#pragma once

#include <array>
#include <cstddef>

namespace solidtex::engine {

// The points u a + v b + w c around a place, u, v and w from [-1, 1]: a parallelepiped, a
// parallelogram where an axis is zero, a line where two are.
struct Axes {
  using Axis = std::array<double, 3>;
  std::array<Axis, 3> axis{};  // a, b, c: half the edges, in texels

  static Axes of(const float* nine);  // a, b, c, each as x, y, z
  static Axes cube(float radius);

  bool is_point() const;
  // With axes of kEndless texels and more they see nothing but the material's mean.
  bool is_endless() const;
  // The radius if this is a cube with its edges along x, y and z, in this order; else zero.
  float cube_radius() const;
};

inline constexpr double kEndless = 4096;

// A footprint as equal parts, side by side: count[i] along axis i.
struct Parts {
  Axes axes;  // of each
  std::array<int, 3> count = {1, 1, 1};
  double reach = 0;  // half of a part's longest edge

  int total() const { return count[0] * count[1] * count[2]; }
};

// Cuts along the axes that are longer than others, up to `most` parts, the longest edges first, and
// no further than to cubes or to a reach of `least`. A cube stays whole; so does what is endless.
Parts cut(const Axes& axes, int most, double least);

// use(step) for the middle of each part, as a step from the middle of all.
template <class Use>
void for_each_middle(const Parts& parts, const Use& use) {
  const auto& [a, b, c] = parts.axes.axis;
  for (int u = 1 - parts.count[0]; u < parts.count[0]; u += 2)
    for (int v = 1 - parts.count[1]; v < parts.count[1]; v += 2)
      for (int w = 1 - parts.count[2]; w < parts.count[2]; w += 2) {
        Axes::Axis step{};
        // What is whole takes no step: zero times infinity is none.
        if (parts.total() > 1) {
          for (std::size_t k = 0; k < 3; ++k) step[k] = u * a[k] + v * b[k] + w * c[k];
        }
        use(step);
      }
}

}  // namespace solidtex::engine
