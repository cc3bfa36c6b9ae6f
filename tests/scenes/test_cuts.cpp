// Cuts: volumes, normals and texture coordinates of faces, refusals.
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/matrix_transform.hpp>
#define GLM_ENABLE_EXPERIMENTAL
#include <glm/gtx/component_wise.hpp>
#include <sstream>

#include "catch.hpp"
#include "plugins/pathtracer/geometry/mesh.h"
#include "tests/scenes/support.h"

using namespace scene_tests;

namespace {

constexpr auto kSubtract = pt::Cut::Operation::subtract;
constexpr auto kIntersect = pt::Cut::Operation::intersect;

pt::Mesh moved(pt::Mesh mesh, const glm::dvec3& by) {
  pt::transform_mesh(mesh, glm::translate(glm::dmat4(1), by));
  return mesh;
}

pt::Mesh open_cube() {
  pt::Mesh cube = make_cube();
  cube.file = "lidless.ply";
  cube.triangles.pop_back();
  return cube;
}

// Two overlapping cubes as one mesh.
pt::Mesh crossing_cubes() {
  pt::Mesh cubes = make_cube();
  const pt::Mesh second = moved(make_cube(), {1, 0.5, 0.25});
  const auto first = static_cast<unsigned>(cubes.positions.size());
  cubes.positions.insert(cubes.positions.end(), second.positions.begin(), second.positions.end());
  for (const glm::uvec3& t : second.triangles) cubes.triangles.push_back(t + glm::uvec3(first));
  cubes.file = "crossing.ply";
  return cubes;
}

// A comb with teeth as an OBJ: its bottom and top are one concave polygon each. Between two teeth
// both have a vertex in the middle of a straight edge.
std::string comb_obj(unsigned teeth, const glm::dvec3& at) {
  std::vector<glm::dvec2> outline = {{0, 0}, {2.0 * teeth, 0}};
  for (unsigned tooth = teeth; tooth-- > 0;) {
    const double x = 2.0 * tooth;
    for (const glm::dvec2& step : {glm::dvec2(2, 1), {1.5, 1}, {1, 1}, {1, 4}, {0, 4}}) {
      outline.emplace_back(x + step.x, step.y);
    }
  }
  std::ostringstream text, bottom, top, sides;
  text.precision(12);
  const std::size_t count = outline.size();
  for (const double z : {0.0, 1.0}) {
    for (const glm::dvec2& p : outline) {
      text << "v " << at.x + p.x << ' ' << at.y + p.y << ' ' << at.z + z << '\n';
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t next = (i + 1) % count;
    bottom << ' ' << count - i;
    top << ' ' << i + 1 + count;
    sides << "f " << i + 1 << ' ' << next + 1 << ' ' << next + 1 + count << ' ' << i + 1 + count
          << '\n';
  }
  text << 'f' << bottom.str() << "\nf" << top.str() << '\n' << sides.str();
  return text.str();
}

// Whether every edge has one face on each side.
bool is_closed(const pt::Mesh& mesh) {
  pt::Mesh copy = mesh;
  return pt::repair_mesh(copy).closed;
}

}  // namespace

TEST_CASE("Tools are closed solids of the right size") {
  CHECK(signed_volume(pt::make_box({1, 2, 3})) == Approx(6));
  CHECK(signed_volume(pt::make_sphere(2)) == Approx(4.0 / 3 * glm::pi<double>() * 8).epsilon(0.01));
  pt::Mesh mirrored = pt::make_box({1, 2, 3});
  pt::transform_mesh(mirrored, glm::scale(glm::dmat4(1), {-2, 1, 1}));
  CHECK(signed_volume(mirrored) == Approx(12));
  if (!built_with_cgal()) return;
  CHECK(is_closed(pt::make_box({1, 2, 3})));
  CHECK(is_closed(pt::make_sphere(2)));
}

TEST_CASE("The removed and the remaining part add up to the volume") {
  if (!built_with_cgal()) return;
  const pt::Mesh cube = make_cube();  // volume 8
  pt::Mesh tool = pt::make_sphere(0.8f);
  pt::transform_mesh(tool, glm::translate(glm::dmat4(1), {0.7, 0.9, 0.4}));
  const pt::Mesh rest = pt::cut_mesh(cube, {{kSubtract, tool}});
  const pt::Mesh piece = pt::cut_mesh(cube, {{kIntersect, tool}});
  CHECK(is_closed(rest));
  CHECK(is_closed(piece));
  CHECK(signed_volume(piece) > 0.3);
  CHECK(signed_volume(rest) + signed_volume(piece) == Approx(8).epsilon(1e-5));
}

TEST_CASE("A box minus a box, and a half-space") {
  if (!built_with_cgal()) return;
  const pt::Mesh cube = make_cube();
  const pt::Mesh corner = moved(pt::make_box({2, 2, 2}), {1, 1, 1});  // three coplanar faces
  CHECK(signed_volume(pt::cut_mesh(cube, {{kSubtract, corner}})) == Approx(7));
  for (const glm::vec3& normal : {glm::vec3(0, 1, 0), glm::vec3(1, -2, 0.5), glm::vec3(-3, 1, 1)}) {
    const pt::Mesh half = pt::cut_mesh(cube, {{kSubtract, pt::make_half_space({}, normal, cube)}});
    CAPTURE(normal.x, normal.y, normal.z);
    CHECK(signed_volume(half) == Approx(4).epsilon(1e-5));
    CHECK(is_closed(half));
    for (const glm::vec3& p : half.positions) CHECK(glm::dot(p, normal) < 1e-5f);
  }
  const pt::Mesh far = pt::make_half_space({0, 5, 0}, {0, 1, 0}, cube);
  CHECK(signed_volume(pt::cut_mesh(cube, {{kSubtract, far}})) == Approx(8));
}

TEST_CASE("The result of many cuts is closed") {
  if (!built_with_cgal()) return;
  std::vector<pt::Cut> cuts;
  for (int i = 0; i < 12; ++i) {
    const double angle = 0.37 * i;
    cuts.push_back({kSubtract, moved(pt::make_sphere(0.45f),
                                     {1.1 * std::cos(angle), 0.15 * i - 0.8, std::sin(angle)})});
  }
  const pt::Mesh rest = pt::cut_mesh(make_cube(), cuts);
  CHECK(is_closed(rest));
  CHECK(signed_volume(rest) < 7.5);
}

TEST_CASE("Remaining faces keep their normals, cut faces have the tool's, reversed") {
  if (!built_with_cgal()) return;
  const pt::Mesh ball = pt::make_sphere(1);
  const pt::Cut top{kSubtract, moved(pt::make_box(glm::vec3(4)), {0, 2, 0})};
  const pt::Mesh half = pt::cut_mesh(ball, {top});
  REQUIRE(half.normals.size() == half.positions.size());
  std::size_t flat = 0, round = 0;
  for (std::size_t i = 0; i < half.positions.size(); ++i) {
    const bool on_ball = glm::length(half.normals[i] - glm::normalize(half.positions[i])) < 0.01f;
    const bool on_cut = half.positions[i].y == 0 && half.normals[i] == glm::vec3(0, 1, 0);
    CHECK((on_ball || on_cut));
    flat += on_cut;
    round += on_ball;
  }
  CHECK(flat > 90);
  CHECK(round > 1000);
  const pt::Mesh bowl = pt::cut_mesh(ball, {top, {kSubtract, pt::make_sphere(0.7f)}});
  bool inward = false;
  for (std::size_t i = 0; i < bowl.positions.size(); ++i) {
    if (glm::length(bowl.positions[i]) > 0.71f || bowl.positions[i].y > -0.1f) continue;
    inward = true;
    CHECK(glm::dot(bowl.normals[i], bowl.positions[i]) < -0.69f);
  }
  CHECK(inward);
}

TEST_CASE("Split faces keep their texture coordinates") {
  if (!built_with_cgal()) return;
  pt::Mesh cube = make_cube();
  for (const glm::vec3& p : cube.positions) cube.uvs.emplace_back(p.x + 2 * p.z, p.y);
  const pt::Mesh rest =
      pt::cut_mesh(cube, {{kSubtract, moved(pt::make_sphere(0.5f), {0.2, 1, 0.1})}});
  REQUIRE(rest.uvs.size() == rest.positions.size());
  for (std::size_t i = 0; i < rest.positions.size(); ++i) {
    const glm::vec3& p = rest.positions[i];
    const bool is_old = std::abs(glm::compMax(glm::abs(p)) - 1) < 1e-6f;
    const glm::vec2 expected(p.x + 2 * p.z, p.y);
    const bool kept = glm::length(rest.uvs[i] - expected) < 1e-5f;
    CHECK((kept || rest.uvs[i] == glm::vec2(0)));
    if (!is_old) CHECK(rest.uvs[i] == glm::vec2(0));
  }
}

TEST_CASE("A solid whose faces are concave polygons is cut") {
  if (!built_with_cgal()) return;
  const TemporaryFolder folder;
  const glm::dvec3 places[] = {{0, 0, 0}, {465881.25, 5248342.5, 1200}};
  for (const glm::dvec3& place : places) {
    for (const unsigned teeth : {1u, 3u, 20u}) {
      write_text(folder / "comb.OBJ", comb_obj(teeth, place));
      pt::Mesh comb = pt::load_mesh(folder / "comb.OBJ");
      REQUIRE(pt::repair_mesh(comb).closed);
      CHECK(signed_volume(comb) == Approx(5.0 * teeth));
      const glm::vec3 point(place + glm::dvec3(0.4, 2, 0.5) - comb.origin);
      const pt::Mesh tool = pt::make_half_space(point, {1, 1, 1}, comb);
      const pt::Mesh rest = pt::cut_mesh(comb, {{kSubtract, tool}});
      const pt::Mesh piece = pt::cut_mesh(comb, {{kIntersect, tool}});
      CHECK(is_closed(rest));
      CHECK(signed_volume(rest) > 0.1);
      CHECK(signed_volume(rest) + signed_volume(piece) == Approx(5.0 * teeth));
    }
  }
}

TEST_CASE("A mesh that is not a solid is refused by name") {
  if (!built_with_cgal()) return;
  const pt::Mesh cube = make_cube();
  const auto cut = [](const pt::Mesh& mesh, const pt::Mesh& tool) {
    return pt::cut_mesh(mesh, {{kSubtract, tool}});
  };
  CHECK_THROWS_WITH(cut(open_cube(), cube),
                    ContainsSubstring("lidless.ply") && ContainsSubstring("open surface"));
  CHECK_THROWS_WITH(cut(cube, open_cube()),
                    ContainsSubstring("lidless.ply") && ContainsSubstring("open surface"));
  CHECK_THROWS_WITH(cut(crossing_cubes(), cube),
                    ContainsSubstring("crossing.ply") && ContainsSubstring("intersects itself"));
  CHECK_THROWS_WITH(cut(cube, pt::make_box(glm::vec3(9))), ContainsSubstring("no faces left"));
}

TEST_CASE("A cut object is lit inside; objects with equal cuts share one mesh") {
  if (!built_with_cgal()) return;
  const TemporaryFolder folder;
  write_ply(folder / "cube.ply", make_cube());
  write_noise_model(folder / "noise.solidtex", 2);
  const auto object = [](double x, double radius) {
    return nlohmann::json{{"mesh", "cube.ply"},
                          {"material", "noise"},
                          {"transform", {{{"translate", {x, 0, 0}}}}},
                          {"cuts", {{{"subtract", {{"sphere", radius}}}}}}};
  };
  const nlohmann::json scene = {
      {"version", 1},
      {"camera", {{"position", {0, 2, 6}}, {"look_at", {0, 0, 0}}, {"fov", 40}}},
      {"materials", {{"noise", {{"type", "diffuse"}, {"color", {{"solid", "noise.solidtex"}}}}}}},
      {"objects", {object(-2, 1.2), object(2, 1.2), object(0, 1.3)}},
      {"environment", {{"color", {1, 1, 1}}}}};
  write_text(folder / "scene.json", scene.dump());
  const auto loaded = pt::load_scene(folder / "scene.json");
  CHECK(loaded->meshes.size() == 2);
  CHECK(loaded->objects[0].mesh == loaded->objects[1].mesh);
  CHECK(loaded->objects[2].mesh != loaded->objects[0].mesh);
}
