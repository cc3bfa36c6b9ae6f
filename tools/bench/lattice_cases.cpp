// The lattice family: boxes of voxels, and points whose bricks are in the cache.
#include "tools/bench/cases.h"
#include "tools/bench/cost.h"
#include "tools/bench/points.h"

namespace solidtex::tools {
namespace {

using Place = std::array<std::int64_t, 3>;

Case lattice_case(const solidtex::texture& texture, std::int64_t edge) {
  Case made;
  made.unit = "voxel";
  made.units_per_call = static_cast<double>(edge * edge * edge);
  made.multiply_adds_per_unit =
      direct_multiply_adds(nlohmann::json::parse(texture.metadata_json()));
  return made;
}

// One call for each offset: a cube whose corner has this offset from an unvisited place.
Case cubes(const solidtex::texture& texture, std::int64_t edge, const std::vector<Place>& offsets,
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
  Case made = lattice_case(texture, edge);
  made.time_call = timed(static_cast<int>(offsets.size()), prepare, work);
  return made;
}

Case cubes_apart(const solidtex::texture& texture, std::int64_t edge, std::size_t calls) {
  return cubes(texture, edge, std::vector<Place>(calls), true);
}

// Bricks cut by a flat surface, row after row, as a renderer evaluates them.
Case neighbors(const solidtex::texture& texture, std::int64_t edge, std::int64_t rows) {
  std::vector<Place> offsets;
  for (std::int64_t y = 0; y < rows; ++y)
    for (std::int64_t z = 0; z < rows; ++z) offsets.push_back({0, y * edge, z * edge});
  return cubes(texture, edge, offsets, false);
}

// Points whose bricks are in the cache: interpolation alone.
Case cached_points(const solidtex::texture& texture, const CaseSettings& settings,
                   bool with_gradients) {
  PointQuery query = batch_of(settings, lay_on_plane);
  query.with_gradients = with_gradients;
  query.again = true;
  return point_case(texture, query);
}

}  // namespace

std::vector<CaseInfo> lattice_cases() {
  using S = CaseSettings;
  return {
      {.name = "lattice.256",
       .about = "one box of 256^3 voxels",
       .parallel = true,
       .make = [](Models& m,
                  const S& s) { return cubes_apart(m.lattice(), s.quick ? 24 : 256, 1); }},
      {.name = "lattice.32",
       .about = "one block of 32^3 voxels, at a place not evaluated before",
       .make = [](Models& m, const S& s) { return cubes_apart(m.lattice(), s.quick ? 8 : 32, 1); }},
      {.name = "lattice.16",
       .about = "one brick of 16^3 voxels, at a place not evaluated before",
       .make = [](Models& m, const S& s) { return cubes_apart(m.lattice(), s.quick ? 4 : 16, 1); }},
      {.name = "lattice.16.neighbours",
       .about = "each of 8 x 8 bricks of 16^3 voxels side by side, row after row",
       .make =
           [](Models& m, const S& s) {
             return neighbors(m.lattice(), s.quick ? 4 : 16, s.quick ? 2 : 8);
           }},
      {.name = "lattice.voxel",
       .about = "one voxel, at a place not evaluated before",
       .make = [](Models& m, const S& s) { return cubes_apart(m.lattice(), 1, s.quick ? 1 : 16); }},
      {.name = "lattice.cached",
       .about = "4096 points side by side on a plane, whose bricks are in the cache",
       .make = [](Models& m, const S& s) { return cached_points(m.lattice(), s, false); }},
      {.name = "lattice.cached.gradients",
       .about = "the points of lattice.cached with gradients",
       .make = [](Models& m, const S& s) { return cached_points(m.lattice(), s, true); }},
  };
}

}  // namespace solidtex::tools
