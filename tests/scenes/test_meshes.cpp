// Mesh files that are refused, and mesh repair.
#include <algorithm>
#include <cstring>

#include "catch.hpp"
#include "tests/scenes/support.h"

using namespace scene_tests;

namespace {

// Returns the error of load_mesh.
std::string refusal(const std::filesystem::path& file) {
  try {
    pt::load_mesh(file);
  } catch (const solidtex::mesh::MeshError& error) {
    return error.what();
  }
  return "(accepted)";
}

void check_refused(const std::filesystem::path& file, const std::string& words) {
  const std::string message = refusal(file);
  CAPTURE(message);
  CHECK(message.find(file.string()) != std::string::npos);
  CHECK(message.find(words) != std::string::npos);
}

const std::string kPlyHeader =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";

}  // namespace

TEST_CASE("Invalid meshes are refused by name") {
  const TemporaryFolder folder;
  check_refused(folder / "missing.ply", "no such file");
  write_text(folder / "mesh.fbx", "solid");
  check_refused(folder / "mesh.fbx", "*.ply, *.obj, *.gltf, *.glb, *.stl or *.off");
  write_text(folder / "empty.ply", "");
  check_refused(folder / "empty.ply", "an empty file");
  write_text(folder / "words.obj", "this is no mesh\n");
  check_refused(folder / "words.obj", "expected");
  write_text(folder / "points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
  check_refused(folder / "points.obj", "expected");
  write_text(folder / "line.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n");
  check_refused(folder / "line.obj", "no triangles");
  write_text(folder / "nan.ply", kPlyHeader + "0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n");
  check_refused(folder / "nan.ply", "vertex 1");
  write_text(folder / "infinite.ply", kPlyHeader + "0 0 0\n1 0 0\n0 inf 0\n3 0 1 2\n");
  check_refused(folder / "infinite.ply", "vertex 2");
  write_text(folder / "index.ply", kPlyHeader + "0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n");
  check_refused(folder / "index.ply", "vertex index 3 in face 0");
  write_text(folder / "negative.ply", kPlyHeader + "0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n");
  check_refused(folder / "negative.ply", "in face 0");
  write_text(folder / "index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
  check_refused(folder / "index.obj", "expected");
}

TEST_CASE("Truncated binary PLY files are refused") {
  const TemporaryFolder folder;
  std::string bytes = kPlyHeader;
  bytes.replace(bytes.find("ascii"), 5, "binary_little_endian");
  const float vertices[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const std::int32_t face[] = {0, 1, 2};
  bytes.append(reinterpret_cast<const char*>(vertices), sizeof vertices);
  bytes += '\3';
  bytes.append(reinterpret_cast<const char*>(face), sizeof face);
  write_text(folder / "whole.ply", bytes);
  CHECK(pt::load_mesh(folder / "whole.ply").triangles.size() == 1);
  for (const std::size_t missing : {1u, 8u, 20u, 40u}) {
    const auto file = folder / ("cut" + std::to_string(missing) + ".ply");
    write_text(file, bytes.substr(0, bytes.size() - missing));
    CAPTURE(missing);
    check_refused(file, "expected");
  }
}

TEST_CASE("OBJ and PLY give the same mesh, polygons become triangles") {
  const TemporaryFolder folder;
  write_ply(folder / "cube.ply", make_cube());
  write_obj(folder / "cube.obj", make_cube());
  const pt::Mesh ply = pt::load_mesh(folder / "cube.ply"), obj = pt::load_mesh(folder / "cube.obj");
  CHECK(ply.triangles.size() == 12);
  CHECK(obj.triangles.size() == 12);
  CHECK(signed_volume(ply) == Approx(8));
  CHECK(signed_volume(obj) == Approx(8));

  write_obj(folder / "quad.obj", make_quad(2));
  CHECK(pt::load_mesh(folder / "quad.obj").uvs.size() > 0);
  CHECK(ply.uvs.empty());
  write_text(folder / "pentagon.obj",
             "v 0 0 0\nv 2 0 0\nv 3 2 0\nv 1 3 0\nv -1 2 0\nf 1 2 3 4 5\n");
  CHECK(pt::load_mesh(folder / "pentagon.obj").triangles.size() == 3);
}

TEST_CASE("Repair removes duplicate and degenerate faces and orients faces outward") {
  if (!built_with_cgal()) return;
  pt::Mesh mesh = make_cube();
  mesh.triangles.push_back(mesh.triangles[4]);          // duplicate
  mesh.triangles.push_back({1, 1, 5});                  // degenerate
  std::swap(mesh.triangles[7].y, mesh.triangles[7].z);  // reversed
  const pt::MeshReport report = pt::repair_mesh(mesh);
  CHECK(report.removed_faces == 2);
  CHECK(report.flipped_faces == 1);
  CHECK(report.closed);
  CHECK(report.hole_count == 0);
  CHECK(report.component_count == 1);
  CHECK(mesh.triangles.size() == 12);
  CHECK(signed_volume(mesh) == Approx(8));
  CHECK(
      pt::describe(mesh, report) ==
      "cube: 12 triangles, 1 component, closed; removed 2 duplicate or degenerate faces; reversed "
      "1 faces");
}

TEST_CASE("Repair reverses an inside-out solid and keeps a valid one") {
  if (!built_with_cgal()) return;
  pt::Mesh right = make_cube(), inside_out = make_cube();
  for (auto& t : inside_out.triangles) std::swap(t.y, t.z);
  CHECK(pt::repair_mesh(right).flipped_faces == 0);
  CHECK(pt::repair_mesh(inside_out).flipped_faces == 12);
  CHECK(signed_volume(inside_out) == Approx(8));
}

TEST_CASE("A solid with split vertices is closed, with a missing face open") {
  if (!built_with_cgal()) return;
  const pt::Mesh cube = make_cube();
  pt::Mesh split;  // every face has its own vertices, as from OBJ loaders
  for (const auto& t : cube.triangles) {
    const auto first = static_cast<unsigned>(split.positions.size());
    for (int c = 0; c < 3; ++c) split.positions.push_back(cube.positions[t[c]]);
    split.triangles.push_back({first, first + 1, first + 2});
  }
  CHECK(pt::repair_mesh(split).closed);
  CHECK(split.triangles.size() == 12);
  CHECK(split.positions.size() == 36);
  split.triangles.pop_back();
  const pt::MeshReport open = pt::repair_mesh(split);
  CHECK(!open.closed);
  CHECK(open.hole_count == 1);
}

TEST_CASE("Repair accepts polygon soups: two components, an edge with three faces") {
  if (!built_with_cgal()) return;
  pt::Mesh two = make_cube();
  const pt::Mesh other = make_cube();
  for (const auto& p : other.positions) two.positions.push_back(p + 5.0f);
  for (const auto& t : other.triangles) two.triangles.push_back({t.x + 8, t.z + 8, t.y + 8});
  const pt::MeshReport report = pt::repair_mesh(two);
  CHECK(report.component_count == 2);
  CHECK(report.closed);
  CHECK(report.flipped_faces == 12);
  CHECK(signed_volume(two) == Approx(16));

  pt::Mesh fan{"fan",
               {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}, {-1, 0, -1}},
               {},
               {},
               {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}}};
  const pt::MeshReport fan_report = pt::repair_mesh(fan);
  CHECK(fan.triangles.size() == 3);
  CHECK(!fan_report.closed);

  pt::Mesh nothing{"nothing", {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {}, {}, {{0, 0, 1}}};
  pt::repair_mesh(nothing);
  CHECK(nothing.triangles.empty());
}

namespace {

// A scene far away from zero: a cube with a solid texture, cut, lit by three kinds of lights.
nlohmann::json far_scene(const glm::dvec3& origin, const TemporaryFolder& folder) {
  const auto at = [&](double x, double y, double z) {
    return nlohmann::json{origin.x + x, origin.y + y, origin.z + z};
  };
  std::ostringstream cube;
  cube.precision(12);
  for (const glm::vec3& p : make_cube().positions) {
    cube << "v " << origin.x + p.x << ' ' << origin.y + p.y << ' ' << origin.z + p.z << '\n';
  }
  for (const glm::uvec3& t : make_cube().triangles) {
    cube << "f " << t.x + 1 << ' ' << t.y + 1 << ' ' << t.z + 1 << '\n';
  }
  write_text(folder / "cube.obj", cube.str());
  write_noise_model(folder / "noise.solidtex", 0);
  const nlohmann::json back = {{{"translate", {-origin.x, -origin.y, -origin.z}}}};
  nlohmann::json objects = {{{"mesh", "cube.obj"}, {"material", "object"}},
                            {{"mesh", "cube.obj"}, {"material", "world"}}};
  if (pt::can_repair_meshes()) {
    objects[0]["cuts"] = {
        {{"clip", {{"point", at(0, 0.5, 0)}, {"normal", {1, 1, 0}}}}},
        {{"subtract", {{"sphere", 0.5}, {"transform", {{{"translate", at(1, 0, 1)}}}}}}}};
  }
  objects[1]["transform"] = {{{"translate", {2.5, 0, 0}}}};
  const auto material = [&](const char* space) {
    return nlohmann::json{{"type", "diffuse"},
                          {"color",
                           {{"solid", "noise.solidtex"},
                            {"space", space},
                            {"transform", back},
                            {"texels_per_unit", 8}}}};
  };
  return {{"version", 1},
          {"camera", {{"position", at(6, 5, 8)}, {"look_at", at(1, 0.5, 0.5)}, {"fov", 40}}},
          {"materials", {{"object", material("object")}, {"world", material("world")}}},
          {"objects", objects},
          {"lights",
           {{{"sphere", 1}, {"position", at(0, 8, 4)}, {"radiance", {3, 3, 3}}},
            {{"position", at(8, 6, 2)},
             {"look_at", at(0, 0, 0)},
             {"size", {2, 2}},
             {"radiance", {6, 6, 6}}},
            {{"mesh", "cube.obj"},
             {"transform", {{{"translate", {0, 6, 6}}}}},
             {"radiance", {2, 2, 2}}}}},
          {"environment", {{"color", {0.2, 0.2, 0.2}}}}};
}

pt::AovImage render_far(const glm::dvec3& origin, int turntable_frames) {
  const TemporaryFolder folder;
  write_text(folder / "scene.json", far_scene(origin, folder).dump());
  pt::Sequence sequence(folder / "scene.json");
  if (turntable_frames > 0) sequence.set_turntable(turntable_frames);
  const pt::Scene& scene = sequence.frame(turntable_frames > 0 ? 1 : 0);
  pt::RenderSettings settings = small_settings(48, 4);
  settings.aovs = {pt::Aov::beauty, pt::Aov::position, pt::Aov::texcoord};
  pt::Renderer renderer(scene, settings);
  CHECK(renderer.render());
  return renderer.image();
}

std::size_t count_differences(const std::vector<float>& a, const std::vector<float>& b,
                              float tolerance) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) count += std::abs(a[i] - b[i]) > tolerance;
  return count;
}

}  // namespace

TEST_CASE("A scene at map coordinates gives the image of the same scene at the origin") {
  const glm::dvec3 far(465881.25, 5248342.5, 1200);
  for (const int turntable_frames : {0, 5}) {
    const pt::AovImage here = render_far(glm::dvec3(0), turntable_frames);
    const pt::AovImage there = render_far(far, turntable_frames);
    // Rounding moves a few paths over an edge.
    const auto& beauty = there.values(pt::Aov::beauty);
    const std::size_t differences = count_differences(here.values(pt::Aov::beauty), beauty, 1e-3f);
    CAPTURE(turntable_frames, differences, beauty.size());
    CHECK(save_unless(differences < beauty.size() / 50, pt::beauty(there), "far"));
    CHECK(count_differences(here.values(pt::Aov::texcoord), there.values(pt::Aov::texcoord),
                            0.01f) < beauty.size() / 50);
    const auto& position = there.values(pt::Aov::position);
    CHECK(std::abs(position[3 * (24 * 48 + 24) + 1] - 5248342.5f) < 4);
  }
}

TEST_CASE("An open mesh of a dielectric is noted") {
  if (!built_with_cgal()) return;
  const TemporaryFolder folder;
  write_ply(folder / "open.ply", make_quad(1));
  write_ply(folder / "closed.ply", make_cube());
  write_text(folder / "scene.json", R"({
    "version": 1, "render": {"size": [8, 8], "spp": 1},
    "camera": {"position": [0, 3, 3], "look_at": [0, 0, 0], "fov": 40},
    "environment": {"color": [1, 1, 1]},
    "materials": {"glass": {"type": "dielectric"}, "gray": {"type": "diffuse", "color": [0.5, 0.5, 0.5]}},
    "objects": [{"mesh": "open.ply", "material": "glass"},
                {"mesh": "open.ply", "material": "gray"},
                {"mesh": "closed.ply", "material": "glass"}]})");
  const auto notes = pt::notes_of(*pt::load_scene(folder / "scene.json"));
  CHECK(std::ranges::count_if(notes, [](const std::string& note) {
          return note.starts_with("open.ply: an open mesh of the dielectric \"glass\"");
        }) == 1);
  CHECK(std::ranges::count_if(notes, [](const std::string& note) {
          return note.find("dielectric") != std::string::npos;
        }) == 1);
}
