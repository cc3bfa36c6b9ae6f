#include "tools/bench/points.h"

#include <cmath>
#include <random>
#include <utility>

namespace solidtex::tools {
namespace {

constexpr int batch_edge = 64, quick_batch_edge = 12;  // points along each axis of a square batch

// Points around a place, and buffers for their values.
class PointCalls {
 public:
  PointCalls(const solidtex::texture& texture, PointQuery query)
      : texture_(texture), query_(std::move(query)) {
    const auto count = static_cast<std::size_t>(query_.count);
    points_.resize(3 * count);
    values_.resize(count * texture.channel_count());
    if (query_.with_gradients) gradients_.resize(3 * values_.size());
    place();
    if (query_.again) evaluate();
  }

  int count() const { return query_.count / query_.per_call; }

  void prepare() {
    if (!query_.again) place();
  }

  void evaluate() {
    const auto per_call = static_cast<std::size_t>(query_.per_call);
    const std::size_t results = per_call * texture_.channel_count();
    const std::span<const float> points = points_;
    const std::span<float> values = values_, gradients = gradients_;
    for (std::size_t call = 0; call < static_cast<std::size_t>(count()); ++call)
      texture_.eval_points(
          origin_, points.subspan(3 * call * per_call, 3 * per_call),
          values.subspan(call * results, results),
          gradients.empty() ? gradients : gradients.subspan(3 * call * results, 3 * results));
  }

 private:
  void place() {
    const auto place = unvisited_place();
    for (std::size_t axis = 0; axis < 3; ++axis) origin_[axis] = static_cast<double>(place[axis]);
    query_.fill(points_);
  }

  const solidtex::texture& texture_;
  PointQuery query_;
  std::array<double, 3> origin_{};
  Points points_;
  std::vector<float> values_, gradients_;
};

}  // namespace

void scatter(Points& points) {
  static std::mt19937 random(1);
  for (float& coordinate : points)
    coordinate = static_cast<float>(random() >> 8) * 0x1p-24f * cube_texels;
}

void lay_on_plane(Points& points) {
  const auto edge = static_cast<std::size_t>(std::lround(std::sqrt(points.size() / 3)));
  for (std::size_t i = 0; i < points.size() / 3; ++i) {
    const std::size_t row = i / edge, column = i % edge;
    const auto u = static_cast<float>(row), v = static_cast<float>(column);
    points[3 * i] = 0.8f * u - 0.36f * v;
    points[3 * i + 1] = 0.6f * u + 0.48f * v;
    points[3 * i + 2] = 0.8f * v;
  }
}

PointQuery batch_of(const CaseSettings& settings, FillPoints fill) {
  const int edge = settings.quick ? quick_batch_edge : batch_edge;
  return {.fill = std::move(fill), .count = edge * edge, .per_call = edge * edge};
}

Case point_case(const solidtex::texture& texture, const PointQuery& query) {
  auto calls = std::make_shared<PointCalls>(texture, query);
  Case made;
  made.unit = "point";
  made.units_per_call = query.per_call;
  made.time_call = timed(
      calls->count(), [calls] { calls->prepare(); }, [calls] { calls->evaluate(); });
  return made;
}

}  // namespace solidtex::tools
