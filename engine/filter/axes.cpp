#include "engine/filter/axes.h"

#include <algorithm>
#include <cmath>

namespace solidtex::engine {
namespace {

// Ratio of the longest to the shortest edge up to which a footprint is a cube.
constexpr double kStretch = 1.5;
// More parts must reduce the reach by this factor. The cut of one of several equal axes gains
// nothing until all of them are cut.
constexpr double kWorthwhile = 0.95;

double length(const Axes::Axis& axis) {
  return std::sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
}

}  // namespace

Axes Axes::of(const float* nine) {
  Axes axes;
  for (std::size_t i = 0; i < 9; ++i) axes.axis[i / 3][i % 3] = nine[i];
  return axes;
}

Axes Axes::cube(float radius) {
  Axes axes;
  for (std::size_t i = 0; i < 3; ++i) axes.axis[i][i] = radius;
  return axes;
}

bool Axes::is_point() const { return axis == decltype(axis){}; }

bool Axes::is_endless() const {
  return std::ranges::any_of(axis, [](const Axis& a) { return length(a) >= kEndless; });
}

float Axes::cube_radius() const {
  const auto radius = static_cast<float>(axis[0][0]);
  return axis == cube(radius).axis ? radius : 0;
}

Parts cut(const Axes& axes, int max_parts, double min_reach) {
  std::array<double, 3> whole;
  for (std::size_t i = 0; i < 3; ++i) whole[i] = length(axes.axis[i]);
  Parts best{.axes = axes, .reach = *std::ranges::max_element(whole)};
  if (axes.is_endless()) return best;
  const double enough = std::max(kStretch * *std::ranges::min_element(whole), min_reach);
  std::array<double, 3> part = whole;
  for (Parts next = best; best.reach > enough;) {
    const auto longest = static_cast<std::size_t>(std::ranges::max_element(part) - part.begin());
    ++next.count[longest];
    if (next.total() > max_parts) break;
    part[longest] = whole[longest] / next.count[longest];
    next.reach = *std::ranges::max_element(part);
    if (next.reach < kWorthwhile * best.reach) best = next;
  }
  for (std::size_t i = 0; i < 3; ++i)
    for (double& component : best.axes.axis[i]) component /= best.count[i];
  return best;
}

}  // namespace solidtex::engine
