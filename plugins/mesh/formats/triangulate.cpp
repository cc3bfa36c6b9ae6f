#include "plugins/mesh/formats/triangulate.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace solidtex::mesh {
namespace {

// Sines of angles below this are those of a straight line that was rounded.
constexpr double kStraight = 1e-12;

double cross(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

// By Newell's method: also of a polygon that is concave or not flat.
glm::dvec3 normal_of(const std::vector<glm::dvec3>& ring) {
  glm::dvec3 normal(0);
  for (std::size_t i = 0; i < ring.size(); ++i) {
    normal += glm::cross(ring[i], ring[(i + 1) % ring.size()]);
  }
  return normal;
}

// Seen from the side that the polygon goes round counterclockwise, along an axis: that rounds
// nothing.
std::vector<glm::dvec2> project(const std::vector<glm::dvec3>& ring) {
  const glm::dvec3 normal = normal_of(ring), size = glm::abs(normal);
  int axis = size.x > size.y ? 0 : 1;
  if (size.z > size[axis]) axis = 2;
  int u = (axis + 1) % 3, v = (axis + 2) % 3;
  if (normal[axis] < 0) std::swap(u, v);
  std::vector<glm::dvec2> flat;
  flat.reserve(ring.size());
  for (const glm::dvec3& p : ring) flat.emplace_back(p[u], p[v]);
  return flat;
}

// Whether a, b, c turn left, by more than rounding does.
bool turns_left(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
  const glm::dvec2 first = b - a, second = c - b;
  const double lengths = std::sqrt(glm::dot(first, first) * glm::dot(second, second));
  return cross(first, second) > kStraight * lengths;
}

// Whether the way from a to b goes back along itself to c: a spike without area.
bool turns_back(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
  const bool is_straight = !turns_left(a, b, c) && !turns_left(c, b, a);
  return is_straight && glm::dot(b - a, c - b) < 0;
}

bool is_convex(const std::vector<glm::dvec2>& ring) {
  const std::size_t count = ring.size();
  for (std::size_t i = 0; i < count; ++i) {
    const glm::dvec2 &b = ring[(i + 1) % count], &c = ring[(i + 2) % count];
    if (!turns_left(ring[i], b, c)) return false;
    const bool in_fan = i > 0 && i + 1 < count;
    if (in_fan && !turns_left(ring[0], ring[i], b)) return false;
  }
  return true;
}

// Ear clipping: cuts off corners between whose neighbors the polygon can be divided.
class EarClipper {
 public:
  EarClipper(const std::vector<glm::dvec2>& ring, std::uint64_t& budget)
      : ring_(ring), budget_(budget) {
    const auto count = static_cast<unsigned>(ring.size());
    for (unsigned i = 0; i < count; ++i) {
      next_.push_back((i + 1) % count);
      previous_.push_back((i + count - 1) % count);
    }
  }

  // Appends indices into the ring.
  bool clip(std::vector<glm::uvec3>& triangles) {
    unsigned at = 0, tried = 0;
    for (std::size_t left = ring_.size(); left > 3; --left) {
      // A polygon that is not simple may have no ear: then whatever is convex, then anything.
      for (tried = 0; !is_ear(at, tried / left); ++tried) {
        if (budget_ == 0) return false;
        at = next_[at];
      }
      if (budget_ == 0) return false;
      triangles.emplace_back(previous_[at], at, next_[at]);
      next_[previous_[at]] = next_[at];
      previous_[next_[at]] = previous_[at];
      at = next_[next_[at]];
    }
    triangles.emplace_back(previous_[at], at, next_[at]);
    return true;
  }

 private:
  void pay() { budget_ -= budget_ > 0; }

  bool is_ear(unsigned corner, std::size_t leniency) {
    pay();
    const glm::dvec2 &a = ring_[previous_[corner]], &b = ring_[corner], &c = ring_[next_[corner]];
    if (leniency > 1 || turns_back(a, b, c)) return true;
    if (!turns_left(a, b, c)) return false;
    if (leniency > 0) return true;
    const glm::dvec2 low = glm::min(a, glm::min(b, c)), high = glm::max(a, glm::max(b, c));
    for (unsigned i = next_[next_[corner]]; i != previous_[corner]; i = next_[i]) {
      pay();
      const glm::dvec2& p = ring_[i];
      if (p.x < low.x || p.y < low.y || p.x > high.x || p.y > high.y) continue;
      if (p == a || p == b || p == c) continue;
      const bool is_outside =
          cross(b - a, p - a) < 0 || cross(c - b, p - b) < 0 || cross(a - c, p - c) < 0;
      if (!is_outside) return false;
    }
    return true;
  }

  const std::vector<glm::dvec2>& ring_;
  std::vector<unsigned> next_, previous_;
  std::uint64_t& budget_;
};

// Indices of corners that are not at the place of the one before.
std::vector<unsigned> distinct_corners(std::span<const glm::dvec3> corners) {
  std::vector<unsigned> kept;
  for (unsigned i = 0; i < corners.size(); ++i) {
    if (kept.empty() || corners[i] != corners[kept.back()]) kept.push_back(i);
  }
  while (kept.size() > 1 && corners[kept.back()] == corners[kept.front()]) kept.pop_back();
  return kept;
}

}  // namespace

bool triangulate(std::span<const glm::dvec3> corners, std::vector<glm::uvec3>& triangles,
                 std::uint64_t& budget) {
  const std::vector<unsigned> kept = distinct_corners(corners);
  if (kept.size() < 3) return true;
  if (kept.size() == 3) {
    triangles.emplace_back(kept[0], kept[1], kept[2]);
    return true;
  }
  std::vector<glm::dvec3> ring;
  ring.reserve(kept.size());
  for (const unsigned corner : kept) ring.push_back(corners[corner] - corners[kept[0]]);
  const std::vector<glm::dvec2> flat = project(ring);
  std::vector<glm::uvec3> found;
  if (is_convex(flat)) {
    for (unsigned i = 1; i + 1 < flat.size(); ++i) found.emplace_back(0, i, i + 1);
  } else if (!EarClipper(flat, budget).clip(found)) {
    return false;
  }
  for (const glm::uvec3& t : found) triangles.emplace_back(kept[t.x], kept[t.y], kept[t.z]);
  return true;
}

}  // namespace solidtex::mesh
