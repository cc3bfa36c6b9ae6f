// The point family, through solidtex_eval_points.
#include <cmath>
#include <random>

#include "tools/bench/cases.h"
#include "tools/bench/cost.h"

namespace solidtex::tools {
namespace {

constexpr int batch_edge = 64, quick_batch_edge = 12;  // points along each axis of a square batch
constexpr float cube_texels = 256;

int batch_points(const CaseSettings& settings) {
  const int edge = settings.quick ? quick_batch_edge : batch_edge;
  return edge * edge;
}

using Points = std::vector<float>;
using FillPoints = std::function<void(Points&)>;

// Uniform in a cube: hardly two points share a cell of the finer octaves.
void scatter(Points& points) {
  static std::mt19937 random(1);
  for (float& coordinate : points)
    coordinate = static_cast<float>(random() >> 8) * 0x1p-24f * cube_texels;
}

// A square of a plane that no axis lies in, a texel between neighbours, as a camera sees it.
void lay_on_plane(Points& points) {
  const auto edge = static_cast<std::size_t>(std::lround(std::sqrt(points.size() / 3)));
  for (std::size_t i = 0; i < points.size() / 3; ++i) {
    const auto u = static_cast<float>(i / edge), v = static_cast<float>(i % edge);
    points[3 * i] = 0.8f * u - 0.36f * v;
    points[3 * i + 1] = 0.6f * u + 0.48f * v;
    points[3 * i + 2] = 0.8f * v;
  }
}

// `count` points around an unvisited place, so many to a call.
Case point_case(const solidtex::texture& texture, int count, int per_call, FillPoints fill) {
  struct State {
    std::array<double, 3> origin;
    Points points;
    std::vector<float> values;
  };
  auto state = std::make_shared<State>();
  state->points.resize(3 * static_cast<std::size_t>(count));
  state->values.resize(static_cast<std::size_t>(count) * texture.channel_count());
  const auto prepare = [state, fill = std::move(fill)] {
    const auto place = unvisited_place();
    for (int axis = 0; axis < 3; ++axis) state->origin[axis] = static_cast<double>(place[axis]);
    fill(state->points);
  };
  const auto work = [state, per_call, &texture] {
    const std::size_t coordinates = 3 * static_cast<std::size_t>(per_call);
    const std::size_t results = static_cast<std::size_t>(per_call) * texture.channel_count();
    const std::span<const float> points = state->points;
    const std::span<float> values = state->values;
    for (std::size_t call = 0; call < points.size() / coordinates; ++call)
      texture.eval_points(state->origin, points.subspan(call * coordinates, coordinates),
                          values.subspan(call * results, results));
  };
  Case made;
  made.unit = "point";
  made.units_per_call = per_call;
  made.multiply_adds_per_unit =
      direct_multiply_adds(nlohmann::json::parse(texture.metadata_json()));
  made.repeat = timed(count / per_call, prepare, work);
  return made;
}

Case batch(const solidtex::texture& texture, const CaseSettings& settings, FillPoints fill) {
  const int count = batch_points(settings);
  return point_case(texture, count, count, std::move(fill));
}

}  // namespace

std::vector<CaseInfo> sampler_cases() {
  using S = CaseSettings;
  return {
      {.name = "sampler.batch",
       .about = "4096 points scattered in a cube of 256^3 texels",
       .parallel = true,
       .make = [](Models& m, const S& s) { return batch(m.sampler(), s, scatter); }},
      {.name = "sampler.fast",
       .about = "the points of sampler.batch in fast precision",
       .parallel = true,
       .make = [](Models& m, const S& s) { return batch(m.fast_sampler(), s, scatter); }},
      {.name = "sampler.coherent",
       .about = "4096 points side by side on a plane",
       .parallel = true,
       .make = [](Models& m, const S& s) { return batch(m.sampler(), s, lay_on_plane); }},
      {.name = "sampler.point",
       .about = "one point a call, scattered in a cube of 256^3 texels",
       .make = [](Models& m,
                  const S& s) { return point_case(m.sampler(), s.quick ? 8 : 512, 1, scatter); }},
  };
}

}  // namespace solidtex::tools
