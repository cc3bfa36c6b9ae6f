// The lattice family, through solidtex_eval_box, and points that its cache answers.
#include "tools/bench/cases.h"
#include "tools/bench/cost.h"
#include "tools/bench/points.h"

namespace solidtex::tools {
namespace {

using Place = std::array<std::int64_t, 3>;

Case field_case(const solidtex::texture& texture, std::int64_t edge) {
  Case made;
  made.unit = "voxel";
  made.units_per_call = static_cast<double>(edge * edge * edge);
  made.multiply_adds_per_unit =
      direct_multiply_adds(nlohmann::json::parse(texture.metadata_json()));
  return made;
}

// Cubes whose corners relative to an unvisited place are `offsets`, one call each.
Case cubes(const solidtex::texture& texture, std::int64_t edge, std::vector<Place> offsets,
           bool apart) {
  struct State {
    std::vector<Place> corners;
    std::vector<float> values;
  };
  auto state = std::make_shared<State>();
  state->values.resize(static_cast<std::size_t>(edge * edge * edge) * texture.channel_count());
  const auto prepare = [state, offsets, apart] {
    state->corners.clear();
    Place place = unvisited_place();
    for (const Place& offset : offsets) {
      if (apart) place = unvisited_place();
      state->corners.push_back({place[0] + offset[0], place[1] + offset[1], place[2] + offset[2]});
    }
  };
  const auto work = [state, edge, &texture] {
    for (const Place& corner : state->corners)
      texture.eval_box(corner, {edge, edge, edge}, state->values);
  };
  Case made = field_case(texture, edge);
  made.repeat = timed(static_cast<int>(offsets.size()), prepare, work);
  return made;
}

Case cubes_apart(const solidtex::texture& texture, std::int64_t edge, std::size_t calls) {
  return cubes(texture, edge, std::vector<Place>(calls), true);
}

// Bricks that a flat surface cuts, row after row, as a renderer comes to them.
Case neighbours(const solidtex::texture& texture, std::int64_t edge, std::int64_t rows) {
  std::vector<Place> offsets;
  for (std::int64_t y = 0; y < rows; ++y)
    for (std::int64_t z = 0; z < rows; ++z) offsets.push_back({0, y * edge, z * edge});
  return cubes(texture, edge, std::move(offsets), false);
}

// Points whose bricks are there: interpolation alone.
Case cached_points(const solidtex::texture& texture, const CaseSettings& settings,
                   bool with_gradients) {
  PointQuery query = batch_of(settings, lay_on_plane);
  query.with_gradients = with_gradients;
  query.again = true;
  return point_case(texture, query);
}

}  // namespace

std::vector<CaseInfo> field_cases() {
  using S = CaseSettings;
  return {
      {.name = "field.256",
       .about = "one box of 256^3 voxels",
       .parallel = true,
       .make = [](Models& m, const S& s) { return cubes_apart(m.field(), s.quick ? 24 : 256, 1); }},
      {.name = "field.32",
       .about = "one block of 32^3 voxels, at a place never asked for before",
       .make = [](Models& m, const S& s) { return cubes_apart(m.field(), s.quick ? 8 : 32, 1); }},
      {.name = "field.16",
       .about = "one brick of 16^3 voxels, at a place never asked for before",
       .make = [](Models& m, const S& s) { return cubes_apart(m.field(), s.quick ? 4 : 16, 1); }},
      {.name = "field.16.neighbours",
       .about = "each of 8 x 8 bricks of 16^3 voxels side by side, row after row",
       .make = [](Models& m,
                  const S& s) { return neighbours(m.field(), s.quick ? 4 : 16, s.quick ? 2 : 8); }},
      {.name = "field.voxel",
       .about = "one voxel, at a place never asked for before",
       .make = [](Models& m, const S& s) { return cubes_apart(m.field(), 1, s.quick ? 1 : 16); }},
      {.name = "field.cached",
       .about = "4096 points side by side on a plane, whose bricks are in the cache",
       .make = [](Models& m, const S& s) { return cached_points(m.field(), s, false); }},
      {.name = "field.cached.gradients",
       .about = "the points of field.cached with gradients",
       .make = [](Models& m, const S& s) { return cached_points(m.field(), s, true); }},
  };
}

}  // namespace solidtex::tools
