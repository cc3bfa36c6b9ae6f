// STL, binary and text. Normals are left out: they say no more than the triangles do.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "plugins/mesh/formats/readers.h"
#include "plugins/mesh/formats/text.h"

namespace solidtex::mesh {
namespace {

constexpr std::size_t kHeader = 80, kTriangle = 50;

std::uint32_t little_endian(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

void add_corner(PolygonMesh& mesh, const glm::dvec3& position) {
  mesh.corners.push_back({static_cast<std::uint32_t>(mesh.positions.size())});
  mesh.positions.push_back(position);
}

PolygonMesh read_binary(const std::string& file, std::string_view content) {
  PolygonMesh mesh;
  const std::uint64_t promised = little_endian(content, kHeader);
  std::string_view rest = content.substr(kHeader + 4);
  const std::uint64_t there = rest.size() / kTriangle;
  if (there < promised) {
    refuse(file,
           std::to_string(there) + " of the " + count_of(promised, "triangle") +
               " that the header promises",
           "all: the file is cut short, copy or export it again");
  }
  for (std::uint64_t t = 0; t < promised; ++t, rest.remove_prefix(kTriangle)) {
    for (std::size_t corner = 1; corner <= 3; ++corner) {
      glm::dvec3 position;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::uint32_t bits = little_endian(rest, 12 * corner + 4 * axis);
        position[static_cast<int>(axis)] = std::bit_cast<float>(bits);
        const double size = std::abs(position[static_cast<int>(axis)]);
        mesh.rounding_error = std::max(mesh.rounding_error, 0x1p-24 * size);
      }
      add_corner(mesh, position);
    }
    mesh.end_face(3);
  }
  if (!rest.empty()) {
    mesh.warnings.push_back(count_of(rest.size(), "byte") + " after the last triangle left out");
  }
  return mesh;
}

PolygonMesh read_text(const std::string& file, std::string_view content) {
  PolygonMesh mesh;
  std::size_t line_number = 0, corners = 0;
  bool is_open = false;
  while (!content.empty()) {
    std::string_view line = take_line(content);
    ++line_number;
    const std::string keyword = in_small_letters(take_word(line));
    is_open = keyword == "solid" || (is_open && keyword != "endsolid");
    if (keyword == "endloop") {
      mesh.end_face(corners);
      corners = 0;
    }
    if (keyword != "vertex") continue;
    glm::dvec3 position;
    for (int axis = 0; axis < 3; ++axis) {
      const std::string_view word = take_word(line);
      const auto number = to_number(word);
      if (!number) {
        refuse(file, quote(word) + " in line " + std::to_string(line_number),
               content.empty() ? "a number: the file is cut short, copy or export it again"
                               : "a number");
      }
      position[axis] = *number;
    }
    add_corner(mesh, position);
    ++corners;
  }
  if (is_open || corners > 0) {
    refuse(file, count_of(mesh.face_sizes.size(), "triangle") + " and no end",
           "\"endsolid\" as the last line: the file is cut short, copy or export it again");
  }
  return mesh;
}

// Binary files may begin with "solid", too. Text has no zero bytes.
bool is_binary(std::string_view content) {
  if (content.size() < kHeader + 4) return false;
  const std::uint64_t size =
      kHeader + 4 + kTriangle * std::uint64_t{little_endian(content, kHeader)};
  if (size == content.size()) return true;
  return content.substr(0, 1024).find('\0') != content.npos;
}

}  // namespace

PolygonMesh read_stl(const std::string& file, std::string_view content) {
  const std::string_view text = without_bom(content);
  PolygonMesh mesh = is_binary(content) ? read_binary(file, content) : read_text(file, text);
  mesh.file = file;
  return mesh;
}

}  // namespace solidtex::mesh
