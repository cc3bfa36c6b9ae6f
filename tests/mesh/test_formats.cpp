// OBJ, glTF, STL and OFF; polygons.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "catch.hpp"
#include "plugins/mesh/formats/triangulate.h"
#include "tests/mesh/support.h"

using namespace mesh_tests;

namespace {

std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.6f", value);
  return text;
}

std::string obj_vertices(const glm::dvec3& away = {}) {
  std::string text;
  for (const glm::dvec3& p : kCorners) {
    text += "v " + number(p.x + away.x) + " " + number(p.y + away.y) + "\t" + number(p.z + away.z) +
            "\n";
  }
  return text;
}

// `shift` makes indices start at 1, or negative.
std::string obj_faces(int shift = 1) {
  std::string text;
  for (const auto& side : kSides) {
    text += "f";
    for (const int vertex : side) text.append(" ").append(std::to_string(vertex + shift));
    text += "\n";
  }
  return text;
}

void check_box(const Mesh& mesh) {
  CHECK(area(mesh) == Approx(22));
  CHECK(volume(mesh) == Approx(6));
}

std::string with_line_ends(const std::string& text, const std::string& end) {
  std::string result;
  for (const char c : text) result += c == '\n' ? end : std::string(1, c);
  return result;
}

void check_has(const std::string& text, const std::string& part) {
  CAPTURE(text);
  CHECK(text.find(part) != text.npos);
}

// A box of triangles as glTF; the buffer holds positions, then indices.
std::string gltf_buffer() {
  std::string bytes;
  for (const glm::dvec3& p : kCorners) {
    for (int axis = 0; axis < 3; ++axis) bytes += bytes_of(static_cast<float>(p[axis]));
  }
  for (const auto& side : kSides) {
    for (const std::size_t corner : {0u, 1u, 2u, 0u, 2u, 3u}) {
      bytes += bytes_of(static_cast<std::uint16_t>(side[corner]));
    }
  }
  return bytes;
}

std::string gltf_json(const std::string& buffer, const std::string& node = "") {
  return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
    "nodes": [{"children": [1])" +
         node + R"(}, {"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
    "buffers": [{)" +
         buffer + R"("byteLength": 168}],
    "bufferViews": [{"buffer": 0, "byteLength": 96},
                    {"buffer": 0, "byteOffset": 96, "byteLength": 72}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"},
                  {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"}]})";
}

std::string glb(std::string json, std::string bytes) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const auto size = static_cast<std::uint32_t>(28 + json.size() + bytes.size());
  return "glTF" + bytes_of(2u) + bytes_of(size) +
         bytes_of(static_cast<std::uint32_t>(json.size())) + "JSON" + json +
         bytes_of(static_cast<std::uint32_t>(bytes.size())) + std::string("BIN\0", 4) + bytes;
}

std::string base64(const std::string& bytes) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {  // whose size is divisible by 3
    unsigned word = 0;
    for (std::size_t k = 0; k < 3; ++k) word = word << 8 | static_cast<unsigned char>(bytes[i + k]);
    for (int shift = 18; shift >= 0; shift -= 6) text += digits[word >> shift & 63];
  }
  return text;
}

std::string binary_stl(const std::string& header) {
  std::string content = header;
  content.resize(80, '\0');
  content += bytes_of(12u);
  for (const auto& side : kSides) {
    for (const std::size_t second : {1u, 2u}) {
      content += std::string(12, '\0');
      for (const std::size_t corner : std::initializer_list<std::size_t>{0, second, second + 1}) {
        const glm::dvec3& p = kCorners[static_cast<std::size_t>(side[corner])];
        for (int axis = 0; axis < 3; ++axis) content += bytes_of(static_cast<float>(p[axis]));
      }
      content += std::string(2, '\0');
    }
  }
  return content;
}

std::string text_stl() {
  std::string text = "solid box\n";
  for (const auto& side : kSides) {
    for (const std::size_t second : {1u, 2u}) {
      text += " facet normal 0 0 0\n  outer loop\n";
      for (const std::size_t corner : std::initializer_list<std::size_t>{0, second, second + 1}) {
        const glm::dvec3& p = kCorners[static_cast<std::size_t>(side[corner])];
        text += "   vertex " + number(p.x) + " " + number(p.y) + " " + number(p.z) + "\n";
      }
      text += "  endloop\n endfacet\n";
    }
  }
  return text + "endsolid box";
}

std::string off(const std::string& header) {
  std::string text = header;
  for (const glm::dvec3& p : kCorners) {
    text += number(p.x) + " " + number(p.y) + " " + number(p.z) + "\n";
  }
  for (const auto& side : kSides) {
    text += "4";
    for (const int vertex : side) text.append(" ").append(std::to_string(vertex));
    text += " 0.5 0.5 0.5\n";
  }
  return text;
}

double signed_area(const std::vector<glm::dvec3>& polygon) {
  glm::dvec3 sum(0);
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    sum += glm::cross(polygon[i] - polygon[0], polygon[(i + 1) % polygon.size()] - polygon[0]);
  }
  return 0.5 * glm::length(sum);
}

// Triangles that have no area count, too.
void check_triangulation(const std::vector<glm::dvec3>& polygon) {
  std::vector<glm::uvec3> triangles;
  std::uint64_t budget = kTriangulationBudget;
  REQUIRE(triangulate(polygon, triangles, budget));
  REQUIRE(triangles.size() == polygon.size() - 2);
  double sum = 0, least = 1e30;
  for (const glm::uvec3& t : triangles) {
    const double part = signed_area({polygon[t.x], polygon[t.y], polygon[t.z]});
    sum += part;
    least = std::min(least, part);
  }
  CHECK(sum == Approx(signed_area(polygon)));
  CHECK(least > 0);
}

}  // namespace

TEST_CASE("OBJ as programs write it") {
  const std::string plain = obj_vertices() + obj_faces();
  for (const std::string& content :
       {plain, "\xef\xbb\xbf" + plain, with_line_ends(plain, "\r\n"), with_line_ends(plain, "\r"),
        plain.substr(0, plain.size() - 1), obj_vertices() + obj_faces(-8),
        obj_faces() + obj_vertices(), "# a comment\nmtllib a.mtl\no box\ng a b\ns off\n" + plain,
        obj_vertices() + "usemtl a\n" + obj_faces() + "l 1 2 3\np 4\n",
        obj_vertices() + "f 1 4 \\\n 3 2 # a comment\n" + obj_faces().substr(10),
        obj_vertices() + "f 1 4 \\ \n 3 \\\n2\n" + obj_faces().substr(10),
        "# from C:\\a\\\n" + obj_vertices() + "g C:\\a\\\n" + obj_faces()}) {
    CAPTURE(content);
    const Mesh mesh = mesh_of(read_obj, content);
    check_box(mesh);
    CHECK(mesh.positions.size() == 8);
    CHECK(mesh.warnings.empty());
  }
}

TEST_CASE("OBJ far away keeps its detail") {
  const glm::dvec3 away(465881.25, 5248342.515625, -1200);
  const Mesh mesh = mesh_of(read_obj, obj_vertices(away) + obj_faces());
  check_box(mesh);
  CHECK(rounding_warning(mesh, 1000).empty());
  CHECK(glm::distance(mesh.position(0), away) < 1e-6);
  CHECK(mesh_of(read_obj, obj_vertices({3, 3, 3}) + obj_faces()).origin == glm::dvec3(0));
}

TEST_CASE("Seams of OBJ split vertices") {
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\n";
  const std::string uvs =
      "vt 0 0\nvt 0.4 0\nvt 0.4 1\nvt 0 1\nvt 0.6 0\nvt 1 0 0\nvt 1 1\nvt 0.6 1\n";
  const Mesh mesh = mesh_of(
      read_obj, vertices + uvs + "vn 0 0 1\nf 1/1/1 2/2/1 3/3/1 4/4/1\nf 2/5 5/6/ 6/7 3/8\n");
  CHECK(mesh.triangles.size() == 4);
  CHECK(mesh.positions.size() == 8);
  CHECK(mesh.normals.size() == 8);
  const glm::uvec3 last = mesh.triangles[2];
  CHECK(mesh.positions[last.x] == glm::vec3(1, 0, 0));
  CHECK(mesh.uvs[last.x] == glm::vec2(0.6f, 0));
}

TEST_CASE("Errors in an OBJ file are named") {
  const auto message = [](const std::string& text) {
    return refusal(read_obj, obj_vertices() + obj_faces() + text);
  };
  check_has(message("f 1 2 9"), "vertex 9 in the face of line 15, expected one of 8 vertices");
  check_has(message("f 1 2 0"), "found \"0\" in line 15, expected an index from 1 on");
  check_has(message("f 1 2 -9"), "found \"-9\" in line 15");
  check_has(message("f 1/1 2/1 3/1"), "texture coordinate 1 in the face of line 15");
  check_has(message("f 1/2/3/4 2 3"), "expected v/vt/vn");
  check_has(message("f 1 2 3.5"), "found \"3.5\"");
  check_has(message("v 1 2"), "found nothing in line 15, expected a number");
  check_has(message("v 1,5 2 3"), "found \"1,5\" in line 15");
  check_has(message("v 1 nan 3"), "vertex 8 at (1, nan");
  check_has(message("v 1 1e999 3"), "vertex 8 at (1, inf");
  check_has(refusal(read_obj, obj_vertices()), "points without a surface");
  check_has(refusal(read_obj, obj_vertices() + "surf 0 1 0 1 1 2 3 4\n"), "curved surfaces");
}

TEST_CASE("Polygons of any shape") {
  check_triangulation({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  check_triangulation({{0, 0, 5}, {4, 0, 5}, {1, 1, 5}, {0, 4, 5}});  // concave
  check_triangulation(
      {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 2, 0}, {1, 2, 0}, {0, 2, 0}});       // middles
  check_triangulation({{0, 0, 0}, {0, 1, 0}, {0, 2, 0}, {0, 3, 0}, {0, 0, 3}});  // a triangle
  const Mesh spike =
      mesh_of(read_obj, "v 0 0 0\nv 2 0 0\nv 4 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nf 1 2 3 4 5 6\n");
  CHECK(area(spike) == Approx(4));
  std::vector<glm::dvec3> comb, star, far;
  for (int tooth = 0; tooth < 40; ++tooth) {
    comb.emplace_back(2 * tooth, 5, 1);
    comb.emplace_back(2 * tooth + 1, 5, 1);
    comb.emplace_back(2 * tooth + 1, 1, 1);
    comb.emplace_back(2 * tooth + 2, 1, 1);
  }
  comb.emplace_back(80, 0, 1);
  comb.emplace_back(0, 0, 1);
  check_triangulation(comb);
  std::reverse(comb.begin(), comb.end());
  check_triangulation(comb);
  for (int i = 0; i < 50; ++i) {
    const double angle = 2 * 3.14159265358979 * i / 50, radius = i % 2 ? 1 : 0.2;
    const glm::dvec3 p(radius * std::cos(angle), radius * std::sin(angle),
                       radius * std::cos(angle));
    star.push_back(p);
    far.push_back(p + glm::dvec3(465881, 5248342, 1200));
  }
  check_triangulation(star);
  check_triangulation(far);
}

TEST_CASE("Degenerate polygons terminate") {
  std::mt19937 random(7);
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<glm::dvec3> polygon;
    for (unsigned i = 0; i < 3 + random() % 20; ++i) {
      polygon.emplace_back(random() % 4, random() % 4, trial % 2 ? random() % 3 : 0);
    }
    std::vector<glm::uvec3> triangles;
    std::uint64_t budget = kTriangulationBudget;
    CHECK(triangulate(polygon, triangles, budget));
    CHECK(triangles.size() < polygon.size());
    for (const glm::uvec3& t : triangles) CHECK(std::max({t.x, t.y, t.z}) < polygon.size());
  }
}

TEST_CASE("A polygon that would take minutes is refused") {
  std::mt19937 random(7);
  std::vector<glm::dvec3> wild, repeated;
  for (int i = 0; i < 20000; ++i) {
    wild.emplace_back(random() % 1000, random() % 1000, 0);
    repeated.emplace_back(i % 3 == 1, i % 3 == 2, 0);
  }
  for (const auto* polygon : {&wild, &repeated}) {
    std::uint64_t budget = 1 << 20;
    std::vector<glm::uvec3> triangles;
    CHECK_FALSE(triangulate(*polygon, triangles, budget));
    CHECK(triangles.empty());
  }
}

TEST_CASE("glTF, in one file and with its data inside") {
  const std::string uri =
      "\"uri\": \"data:application/octet-stream;base64," + base64(gltf_buffer()) + "\", ";
  check_box(mesh_of(read_gltf, gltf_json(uri)));
  const std::string whole = glb(gltf_json(""), gltf_buffer());
  check_box(mesh_of(read_gltf, whole));
  const Mesh moved = mesh_of(
      read_gltf,
      glb(gltf_json("", R"(, "translation": [1e7, 0, 0], "scale": [-2, 2, 2])"), gltf_buffer()));
  CHECK(area(moved) == Approx(88));
  CHECK(volume(moved) == Approx(48));
  CHECK(moved.origin.x == Approx(1e7));

  for (std::size_t size = 0; size < whole.size(); size += 7) {
    CHECK_THROWS_AS(mesh_of(read_gltf, whole.substr(0, size)), MeshError);
  }
  check_has(refusal(read_gltf, gltf_json("\"uri\": \"none.bin\", ")), "no file \"none.bin\"");
  check_has(refusal(read_gltf, glb(gltf_json(R"("x": {}}], "extensionsRequired":
                                                ["KHR_draco_mesh_compression"], "y": [{)"),
                                   gltf_buffer())),
            "KHR_draco_mesh_compression");
  std::string loop = gltf_json("");
  loop.replace(loop.find("{\"mesh\": 0}"), 11, R"({"mesh": 0, "children": [0]})");
  check_has(refusal(read_gltf, glb(loop, gltf_buffer())), "the node 0 twice");
  std::string beyond = gltf_json("");
  beyond.replace(beyond.find("\"count\": 8"), 10, "\"count\": 9");
  check_has(refusal(read_gltf, glb(beyond, gltf_buffer())), "beyond its buffer view");
  CHECK_THROWS_AS(mesh_of(read_gltf, std::string(1u << 20, '[')), MeshError);
}

TEST_CASE("What is left out of a glTF file, or cannot be read, is named") {
  const auto with = [](const std::string& from, const std::string& to) {
    std::string text = gltf_json("");
    return glb(text.replace(text.find(from), from.size(), to), gltf_buffer());
  };
  check_has(refusal(read_gltf, with("2.0", "1.0")), "version \"1.0\", expected glTF \"2.0\"");
  check_has(refusal(read_gltf, with("\"count\": 8", "\"count\": 8, \"sparse\": {}")),
            "without sparse accessors");
  check_has(refusal(read_gltf, with("{\"bufferView\": 0, ", "{")), "without compression");
  const std::string instances = R"("mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {}})";
  CHECK(mesh_of(read_gltf, with("\"mesh\": 0", instances)).warnings.size() == 1);
  CHECK(mesh_of(read_gltf, with("\"mesh\": 0", "\"mesh\": 0, \"skin\": 0")).warnings.size() == 1);
}

TEST_CASE("Mutated glTF files are refused or read") {
  const std::string whole = glb(gltf_json(""), gltf_buffer());
  std::mt19937 random(5);
  std::size_t read = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    std::string content = whole;
    for (unsigned i = 0; i <= random() % 3; ++i) {
      const std::size_t at = random() % content.size();
      content[at] =
          random() % 2 ? static_cast<char>(random()) : "0123456789{}[]:,\"-"[random() % 18];
    }
    try {
      const Mesh mesh = mesh_of(read_gltf, content);
      for (const glm::uvec3& t : mesh.triangles) {
        REQUIRE(std::max({t.x, t.y, t.z}) < mesh.positions.size());
      }
      ++read;
    } catch (const MeshError&) {
    }
  }
  CHECK(read > 100);
  CHECK(read < 3900);
}

TEST_CASE("STL, binary and text") {
  check_box(mesh_of(read_stl, binary_stl("made by a test")));
  check_box(mesh_of(read_stl, binary_stl("solid, but binary")));
  check_box(mesh_of(read_stl, text_stl()));
  check_box(mesh_of(read_stl, with_line_ends(text_stl(), "\r\n")));
  CHECK(mesh_of(read_stl, text_stl()).positions.size() == 8);
  const std::string content = binary_stl("cut");
  check_has(refusal(read_stl, content.substr(0, content.size() - 60)), "10 of the 12 triangles");
  check_has(refusal(read_stl, text_stl().substr(0, 700)), "\"endsolid\" as the last line");
  const std::size_t last = text_stl().rfind("vertex");
  check_has(refusal(read_stl, text_stl().substr(0, last + 8)), "the file is cut short");
  check_has(refusal(read_stl, ""), "no triangles");
}

TEST_CASE("OFF with and without colors") {
  check_box(mesh_of(read_off, off("OFF\n# a comment\n\n8 6 12\n")));
  check_box(mesh_of(read_off, off("OFF 8 6 0\n")));
  CHECK(mesh_of(read_off, off("OFF\n8 5 0\n")).warnings.size() == 1);
  check_has(refusal(read_off, off("OFF\n8 7 0\n")), "6 of the 7 faces");
  const std::string whole = off("OFF\n8 6 0\n");
  check_has(refusal(read_off, whole.substr(0, whole.rfind("\n4 ") + 6)), "cut short");
  check_has(refusal(read_off, off("OFF\n6 6 0\n")), "expected indices");
  check_has(refusal(read_off, off("4OFF\n8 6 0\n")), "found \"4OFF\"");
}

TEST_CASE("Other contents in place of a mesh are named, in every format") {
  const auto folder = std::filesystem::temp_directory_path() / "solidtex-other-contents";
  const auto message = [](const std::filesystem::path& file) {
    try {
      load_mesh(file);
    } catch (const MeshError& error) {
      return std::string(error.what());
    }
    return std::string("(accepted)");
  };
  for (const std::string extension : {".ply", ".OBJ", ".gltf", ".glb", ".stl", ".off"}) {
    const auto check = [&](const std::string& content, const std::string& part) {
      std::filesystem::create_directories(folder);
      const auto file = folder / ("a" + extension);
      std::ofstream(file, std::ios::binary) << content;
      check_has(message(file), part);
    };
    check("", "an empty file");
    check("version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "run git lfs pull");
    check("\n<!DOCTYPE html><html></html>", "an HTML page");
    check("\x1f\x8b\x08", "a gzip archive");
    check("PK\x03\x04", "a ZIP archive");
    check(std::string("\xff\xfev\0", 4), "UTF-16 text");
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder / ("a" + extension));
    check_has(message(folder / ("a" + extension)), "found a folder");
    std::filesystem::remove_all(folder);
  }
}
