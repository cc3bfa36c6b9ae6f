// PLY as programs write it, and as it should never be.
#include <algorithm>
#include <random>

#include "catch.hpp"
#include "tests/mesh/support.h"

using namespace mesh_tests;

namespace {

enum class Order { text, little, big };

// Builds a file value by value; each value has the type that its property has.
class PlyFile {
 public:
  explicit PlyFile(Order order, std::string line_end = "\n")
      : order_(order), end_(std::move(line_end)) {
    const char* names[] = {"ascii", "binary_little_endian", "binary_big_endian"};
    line("ply").line(std::string("format ") + names[static_cast<int>(order)] + " 1.0");
    line("comment made by a test").line("obj_info of no use");
  }

  PlyFile& line(const std::string& text) {
    content_ += text + end_;
    return *this;
  }

  PlyFile& add(const std::string& type, double value) {
    if (order_ == Order::text) {
      std::string text = std::to_string(value);
      if (type != "float" && type != "double") text.resize(text.find('.'));
      content_ += text + " ";
    } else if (type == "char" || type == "int8" || type == "uchar" || type == "uint8") {
      content_ += bytes_of(static_cast<std::int8_t>(static_cast<int>(value)));
    } else if (type == "short" || type == "ushort" || type == "int16" || type == "uint16") {
      content_ += bytes_of(static_cast<std::int16_t>(value), order_ == Order::big);
    } else if (type == "float" || type == "float32") {
      content_ += bytes_of(static_cast<float>(value), order_ == Order::big);
    } else if (type == "double" || type == "float64") {
      content_ += bytes_of(value, order_ == Order::big);
    } else if (type == "int64" || type == "uint64") {
      content_ += bytes_of(static_cast<std::int64_t>(value), order_ == Order::big);
    } else {
      content_ += bytes_of(static_cast<std::int32_t>(value), order_ == Order::big);
    }
    return *this;
  }

  PlyFile& end_row() {
    if (order_ == Order::text) content_ += end_;
    return *this;
  }

  const std::string& content() const { return content_; }

 private:
  Order order_;
  std::string end_, content_;
};

PlyFile& add_vertices(PlyFile& file, const std::string& type) {
  for (const glm::dvec3& p : kCorners) {
    file.add(type, p.x).add(type, p.y).add(type, p.z).end_row();
  }
  return file;
}

PlyFile& add_sides(PlyFile& file, const std::string& count_type, const std::string& type) {
  for (const auto& side : kSides) {
    file.add(count_type, 4);
    for (const int vertex : side) file.add(type, vertex);
    file.end_row();
  }
  return file;
}

PlyFile& vertex_header(PlyFile& file, const std::string& type) {
  file.line("element vertex 8");
  for (const char* name : {"x", "y", "z"}) file.line("property " + type + " " + name);
  return file;
}

std::string box(Order order, const std::string& vertex_type = "float",
                const std::string& count_type = "uchar", const std::string& index_type = "int",
                const std::string& line_end = "\n") {
  PlyFile file(order, line_end);
  vertex_header(file, vertex_type);
  file.line("element face 6")
      .line("property list " + count_type + " " + index_type + " vertex_indices")
      .line("end_header");
  add_sides(add_vertices(file, vertex_type), count_type, index_type);
  return file.content();
}

void check_box(const Mesh& mesh) {
  CHECK(area(mesh) == Approx(22));
  CHECK(volume(mesh) == Approx(6));
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

constexpr Order kOrders[] = {Order::text, Order::little, Order::big};

}  // namespace

TEST_CASE("PLY of every type, byte order and line end") {
  for (const Order order : kOrders) {
    for (const char* type : {"char", "uchar", "short", "ushort", "int", "uint", "float", "double",
                             "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64"}) {
      const bool is_index = type[0] != 'f' && type[0] != 'd';
      CAPTURE(type, static_cast<int>(order));
      check_box(
          mesh_of(read_ply, box(order, type, is_index ? type : "uchar", is_index ? type : "int")));
    }
    for (const char* end : {"\n", "\r\n", "\r"}) {
      check_box(mesh_of(read_ply, box(order, "float", "uchar", "int", end)));
    }
  }
  check_box(mesh_of(read_ply, replaced(box(Order::text), "vertex_indices", "vertex_index")));
  check_box(mesh_of(read_ply, "\xef\xbb\xbf" + box(Order::text)));
}

TEST_CASE("A binary body may begin with any byte") {
  const std::string content = box(Order::little);
  const std::size_t body = content.find("end_header\n") + 11;
  for (const char first : {'\n', '\r', ' ', '\0', '\t'}) {
    std::string changed = content;
    changed[body] = first;  // of the first coordinate, which is 0: a number of 1e-44
    check_box(mesh_of(read_ply, changed));
  }
}

TEST_CASE("Unknown elements and properties are skipped") {
  for (const Order order : kOrders) {
    PlyFile file(order);
    file.line("element range_grid 2").line("property list uchar double range");
    file.line("element nothing 7");
    file.line("element vertex 8").line("property list uchar short labels");
    file.line("property double x").line("property uchar quality").line("property float y");
    file.line("property int16 z").line("property list int float weights");
    file.line("element camera 1").line("property float view_px").line("property int viewportx");
    file.line("element face 7").line("property list uchar uchar flags");
    file.line("property list ushort uint vertex_index").line("property uchar red");
    file.line("element edge 2").line("property int vertex1").line("property int vertex2");
    file.line("end_header");
    for (const int count : {0, 3}) {
      file.add("uchar", count);
      for (int i = 0; i < count; ++i) file.add("double", i);
      file.end_row();
    }
    for (const glm::dvec3& p : kCorners) {
      file.add("uchar", 2).add("short", 7).add("short", -7).add("double", p.x).add("uchar", 200);
      file.add("float", p.y).add("int16", p.z).add("int", 1).add("float", 0.5).end_row();
    }
    file.add("float", 4).add("int", 640).end_row();
    file.add("uchar", 0).add("ushort", 0).add("uchar", 9).end_row();  // no vertices
    for (const auto& side : kSides) {
      file.add("uchar", 1).add("uchar", 3).add("ushort", 4);
      for (const int vertex : side) file.add("uint", vertex);
      file.add("uchar", 255).end_row();
    }
    for (int i = 0; i < 2; ++i) file.add("int", i).add("int", i + 1).end_row();
    const Mesh mesh = mesh_of(read_ply, file.content());
    check_box(mesh);
    REQUIRE(mesh.warnings.size() == 1);
    CHECK(mesh.warnings[0].starts_with("1 face with fewer than three"));
  }
}

TEST_CASE("Faces may come before vertices") {
  for (const Order order : kOrders) {
    PlyFile file(order);
    file.line("element face 6").line("property list uchar int vertex_indices");
    vertex_header(file, "double").line("end_header");
    add_vertices(add_sides(file, "uchar", "int"), "double");
    check_box(mesh_of(read_ply, file.content()));
  }
}

TEST_CASE("Strips are triangles, with and without restarts") {
  const std::vector<std::vector<int>> strips = {
      {0, 3, 1, 2, -1, 4, 5, 7, 6, -1, 0, 1, 4, 5}, {1, 2, 5, 6, -1}, {2, 3, 6, 7}, {3, 0, 7, 4}};
  for (const Order order : kOrders) {
    PlyFile file(order);
    vertex_header(file, "float").line("element tristrips 4");
    file.line("property list int int vertex_indices").line("end_header");
    add_vertices(file, "float");
    for (const auto& strip : strips) {
      file.add("int", static_cast<double>(strip.size()));
      for (const int vertex : strip) file.add("int", vertex);
      file.end_row();
    }
    check_box(mesh_of(read_ply, file.content()));
  }
}

TEST_CASE("Truncated files are refused with both counts") {
  for (const Order order : kOrders) {
    const std::string content = box(order);
    const std::size_t row = order == Order::text ? 0 : 17;
    const std::size_t end = row ? content.size() - 2 * row : content.rfind("4 2 ");
    const std::string message = refusal(read_ply, content.substr(0, end + (row ? 5 : 0)));
    CAPTURE(message);
    CHECK(message.find("found 4 of the 6 faces that the header promises") != message.npos);
    const std::size_t body = content.find("end_header\n") + 11;
    CHECK(refusal(read_ply, content.substr(0, body + 5)).find("0 of the 8 vertices") !=
          message.npos);
    CHECK(refusal(read_ply, content.substr(0, body - 3)).find("header without an end") !=
          message.npos);
  }
  const Mesh longer = mesh_of(read_ply, box(Order::little) + "abc");
  check_box(longer);
  CHECK(longer.warnings ==
        std::vector<std::string>{"3 bytes after what the header lists left out"});
}

TEST_CASE("Errors in a PLY file are named") {
  const std::string content = box(Order::text);
  const auto message = [&](const std::string& from, const std::string& to) {
    return refusal(read_ply, replaced(content, from, to));
  };
  const auto has = [](const std::string& text, const std::string& part) {
    CAPTURE(text);
    CHECK(text.find(part) != text.npos);
  };
  has(message("4 5 6 7", "4 5 6 8"),
      "vertex index 8 in face 1, expected indices from 0 to below 8");
  has(message("4 5 6 7", "4 5 6 -1"), "vertex index -1 in face 1");
  has(message("4 5 6 7", "4 5 6 1.5"), "vertex index 1.5 in face 1");
  has(message("4 5 6 7", "4 5 6 inf"), "vertex index inf in face 1");
  has(message("4 5 6 7", "4 5 6 7 0"), "as many values in each line");
  has(message("4 5 6 7", "4 5 6 x7"), "found \"x7\"");
  has(message("1.000000", "nan"), "vertex 1 at (nan");
  has(message("1.000000", "1,0"), "found \"1,0\"");
  has(message("float x", "half x"), "\"property half x\" in the header");
  has(message("float x", "list uchar float x"), "a list \"x\" of vertices");
  has(message("float x", "float a"), "no vertices with x, y and z");
  has(message("vertex_indices", "corners"), "without vertex indices");
  has(message("element face 6", "element face -6"), "a name and a count");
  has(message("element face 6", "element vertex 6"), "elements of different names");
  has(message("list uchar", "list float"), "a whole number's type");
  has(message("format ascii 1.0", "comment"), "a header without a format");
  has(message("format ascii 1.0", "format binary 1.0"), "ascii, binary_little_endian or");
  has(message("element face 6", "element face 999999999999999"), "6 of the 999999999999999 faces");
  has(replaced(content, "ply\n", "pl\n").empty() ? "" : message("ply\n", "pl\n"), "no PLY file");
  has(refusal(read_ply, content.substr(0, content.find("element face")) + "end_header\n" +
                            content.substr(content.find("0.000000"))),
      "points without a surface");
}

TEST_CASE("Texture coordinates of vertices, by the names that programs use") {
  const std::pair<const char*, const char*> names[] = {
      {"s", "t"}, {"u", "v"}, {"texture_u", "texture_v"}, {"texture_s", "texture_t"}};
  for (const auto& [u, v] : names) {
    PlyFile file(Order::big);
    file.line("element vertex 3").line("property float x").line("property float y");
    file.line("property float z").line(std::string("property float ") + u);
    file.line(std::string("property double ") + v).line("element face 1");
    file.line("property list uchar int vertex_indices").line("end_header");
    for (int i = 0; i < 3; ++i) {
      file.add("float", i).add("float", i * i).add("float", 0);
      file.add("float", 0.25 * i).add("double", 0.5);
    }
    file.add("uchar", 3).add("int", 0).add("int", 1).add("int", 2);
    const Mesh mesh = mesh_of(read_ply, file.content());
    REQUIRE(mesh.uvs.size() == 3);
    CHECK(mesh.uvs[2] == glm::vec2(0.5f, 0.5f));
  }
}

TEST_CASE("Texture coordinates of corners split vertices") {
  for (const Order order : kOrders) {
    PlyFile file(order);
    vertex_header(file, "float").line("element face 6");
    file.line("property list uchar int vertex_indices");
    file.line("property list uchar float texcoord").line("property int texnumber");
    file.line("end_header");
    add_vertices(file, "float");
    for (std::size_t f = 0; f < kSides.size(); ++f) {
      file.add("uchar", 4);
      for (const int vertex : kSides[f]) file.add("int", vertex);
      file.add("uchar", f == 5 ? 0 : 8);
      for (const double corner : {0.0, 0.0, 0.5, 0.0, 0.5, 0.5, 0.0, 0.5}) {
        if (f != 5) file.add("float", corner + 0.0625 * static_cast<double>(f + 1));
      }
      file.add("int", f == 5 ? -1 : 0).end_row();
    }
    const Mesh mesh = mesh_of(read_ply, file.content());
    check_box(mesh);
    REQUIRE(mesh.uvs.size() == mesh.positions.size());
    CHECK(mesh.positions.size() == 24);
    for (std::size_t t = 0; t < 10; ++t) {
      const glm::uvec3 corner = mesh.triangles[t];
      CHECK(mesh.uvs[corner.x] == glm::vec2(0.0625f * static_cast<float>(t / 2 + 1)));
    }
    CHECK(mesh.warnings.at(0).find("several images") != std::string::npos);
    CHECK(mesh.warnings.at(1) == "1 of 6 faces without texture coordinates");
  }
}

TEST_CASE("Far coordinates keep what doubles hold, and singles are warned of") {
  PlyFile file(Order::little);
  vertex_header(file, "double").line("element face 6");
  file.line("property list uchar int vertex_indices").line("end_header");
  const glm::dvec3 away(465881.25, 5248342.0625, 1200.5);
  for (const glm::dvec3& p : kCorners) {
    for (int axis = 0; axis < 3; ++axis) file.add("double", p[axis] + away[axis]);
  }
  const Mesh mesh = mesh_of(read_ply, add_sides(file, "uchar", "int").content());
  check_box(mesh);
  CHECK(mesh.position(2) == kCorners[2] + away);
  CHECK(mesh.rounding_error == 0);
  CHECK(rounding_warning(mesh, 1e6).empty());

  PlyFile single(Order::little);
  vertex_header(single, "float").line("element face 6");
  single.line("property list uchar int vertex_indices").line("end_header");
  for (const glm::dvec3& p : kCorners) {
    for (int axis = 0; axis < 3; ++axis) single.add("float", p[axis] + away[axis]);
  }
  const Mesh rounded = mesh_of(read_ply, add_sides(single, "uchar", "int").content());
  CHECK(rounding_warning(rounded, 20).find("6.3 texels") != std::string::npos);
  CHECK(rounding_warning(rounded, 0.1).empty());
}

// Every mutation is refused or gives a mesh whose indices are right; a sanitizer sees the rest.
TEST_CASE("Mutated PLY files are refused or read") {
  std::mt19937 random(38);
  std::size_t read = 0;
  for (int trial = 0; trial < 6000; ++trial) {
    std::string content = box(kOrders[trial % 3], trial % 2 ? "float" : "short");
    const std::size_t changes = 1 + random() % 4;
    for (std::size_t i = 0; i < changes && !content.empty(); ++i) {
      const std::size_t at = random() % content.size();
      switch (random() % 5) {
        case 0:
          content[at] = static_cast<char>(random());
          break;
        case 1:
          content.erase(at, 1 + random() % 9);
          break;
        case 2:
          content.insert(at, content, random() % content.size(), random() % 30);
          break;
        case 3:
          content.insert(at, 1, "0123456789-.e \n\xff"[random() % 16]);
          break;
        default:
          content.resize(at + 1);
      }
    }
    try {
      const Mesh mesh = mesh_of(read_ply, content);
      for (const glm::uvec3& t : mesh.triangles) {
        REQUIRE(std::max({t.x, t.y, t.z}) < mesh.positions.size());
      }
      ++read;
    } catch (const MeshError&) {
    }
  }
  CHECK(read > 100);
  CHECK(read < 5000);
}

TEST_CASE("An attribute of the vertices of a PLY") {
  const auto file = [](Order order, const std::string& type, double step) {
    PlyFile file(order);
    vertex_header(file, "float").line("property " + type + " wear");
    file.line("element face 6").line("property list uchar int vertex_indices").line("end_header");
    for (std::size_t i = 0; i < kCorners.size(); ++i) {
      const glm::dvec3& p = kCorners[i];
      file.add("float", p.x).add("float", p.y).add("float", p.z);
      file.add(type, step * static_cast<double>(i)).end_row();
    }
    return add_sides(file, "uchar", "int").content();
  };
  const auto attribute_of = [](const std::string& content, const std::string& name) {
    return to_mesh(read_ply("a file", content, name)).attribute;
  };
  for (const Order order : kOrders) {
    const std::vector<float> floats = attribute_of(file(order, "float", 0.25), "wear");
    const std::vector<float> bytes = attribute_of(file(order, "uchar", 15), "wear");
    const std::vector<float> words = attribute_of(file(order, "ushort", 655), "wear");
    REQUIRE((floats.size() == 8 && bytes.size() == 8 && words.size() == 8));
    CHECK(floats[3] == 0.75f);
    CHECK(bytes[3] == Approx(45 / 255.0));
    CHECK(words[3] == Approx(1965 / 65535.0));
  }
  const std::string content = file(Order::text, "float", 0.25);
  CHECK(mesh_of(read_ply, content).attribute.empty());
  const auto message = [&](const std::string& text, const std::string& name) {
    try {
      attribute_of(text, name);
    } catch (const MeshError& error) {
      return std::string(error.what());
    }
    return std::string("(accepted)");
  };
  CHECK(message(content, "moss")
            .find("found vertices with x, y, z, wear, expected also the "
                  "attribute \"moss\"") != std::string::npos);
  CHECK(message(replaced(content, "0.250000", "nan"), "wear")
            .find("as an attribute of vertex 1, expected a finite number") != std::string::npos);
}
