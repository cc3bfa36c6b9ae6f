// Wavefront OBJ: polygons. Materials, groups, lines and points are passed over.
#include "plugins/mesh/formats/readers.h"
#include "plugins/mesh/formats/text.h"

namespace solidtex::mesh {
namespace {

class ObjReader {
 public:
  explicit ObjReader(const std::string& file) { mesh_.file = file; }

  PolygonMesh read(std::string_view content) {
    content = without_bom(content);
    while (!content.empty()) {
      std::string_view line = take_code(content);
      const std::string_view keyword = take_word(line);
      read_line(keyword, line, content);
    }
    check_indices();
    if (has_free_forms_) {
      mesh_.warnings.push_back("curved surfaces left out: export polygons to have them");
    }
    return std::move(mesh_);
  }

 private:
  // The next line without its comment and the blanks at its end.
  std::string_view take_code(std::string_view& content) {
    std::string_view line = take_line(content);
    ++line_;
    line = line.substr(0, line.find('#'));
    while (!line.empty() && is_blank(line.back())) line.remove_suffix(1);
    return line;
  }

  // Numbers that end in a backslash go on in the next line. Names do not: a folder of Windows may
  // end so.
  std::string_view joined(std::string_view line, std::string_view& content) {
    if (!line.ends_with('\\')) return line;
    joined_.clear();
    while (line.ends_with('\\')) {
      joined_.append(line.substr(0, line.size() - 1)) += ' ';
      if (content.empty()) return joined_;
      line = take_code(content);
    }
    joined_.append(line);
    return joined_;
  }

  void read_line(std::string_view keyword, std::string_view line, std::string_view& content) {
    if (keyword == "v") {
      mesh_.positions.push_back(take_numbers(joined(line, content), 3));
    } else if (keyword == "vt") {
      mesh_.uvs.emplace_back(take_numbers(joined(line, content), 1));
    } else if (keyword == "vn") {
      mesh_.normals.emplace_back(take_numbers(joined(line, content), 3));
    } else if (keyword == "f" || keyword == "fo") {
      add_face(joined(line, content));
    } else if (keyword == "surf") {
      has_free_forms_ = true;
    }
  }

  // Up to three, at least `count`; zero for those that are missing.
  glm::dvec3 take_numbers(std::string_view line, int count) const {
    glm::dvec3 numbers(0);
    for (int i = 0; i < 3; ++i) {
      const std::string_view word = take_word(line);
      if (word.empty() && i >= count) break;
      const auto number = to_number(word);
      if (!number) refuse_word(word, "a number");
      numbers[i] = *number;
    }
    return numbers;
  }

  void add_face(std::string_view line) {
    std::size_t count = 0;
    for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
      mesh_.corners.push_back(to_corner(word));
      ++count;
    }
    mesh_.end_face(count);
    face_lines_.push_back(line_);
  }

  // "v", "v/vt", "v//vn" or "v/vt/vn".
  PolygonMesh::Corner to_corner(std::string_view word) const {
    std::string_view parts[3];
    std::string_view rest = word;
    for (std::string_view& part : parts) {
      const std::size_t end = rest.find('/');
      part = rest.substr(0, end);
      rest = end == rest.npos ? std::string_view() : rest.substr(end + 1);
    }
    if (!rest.empty() || parts[0].empty()) refuse_word(word, "v/vt/vn");
    PolygonMesh::Corner corner;
    corner.position = to_index(parts[0], mesh_.positions.size(), word);
    if (!parts[1].empty()) corner.uv = to_index(parts[1], mesh_.uvs.size(), word);
    if (!parts[2].empty()) corner.normal = to_index(parts[2], mesh_.normals.size(), word);
    return corner;
  }

  // From 1 on, or back from the last of the `count` that are known.
  std::uint32_t to_index(std::string_view part, std::size_t count, std::string_view word) const {
    const auto number = to_integer(part);
    if (!number) refuse_word(word, "whole numbers");
    const std::int64_t index =
        *number < 0 ? *number + static_cast<std::int64_t>(count) : *number - 1;
    if (index < 0 || index >= PolygonMesh::kNone) {
      refuse_word(word, "an index from 1 on, or from -1 back");
    }
    return static_cast<std::uint32_t>(index);
  }

  // At the end, since faces may come before their vertices.
  void check_indices() const {
    std::size_t at = 0;
    for (std::size_t f = 0; f < mesh_.face_sizes.size(); ++f) {
      for (std::uint32_t i = 0; i < mesh_.face_sizes[f]; ++i, ++at) {
        const PolygonMesh::Corner& corner = mesh_.corners[at];
        check_index(corner.position, mesh_.positions.size(), "vertex", f);
        check_index(corner.uv, mesh_.uvs.size(), "texture coordinate", f);
        check_index(corner.normal, mesh_.normals.size(), "normal", f);
      }
    }
  }

  void check_index(std::uint32_t index, std::size_t count, const std::string& noun,
                   std::size_t face) const {
    if (index < count || index == PolygonMesh::kNone) return;
    refuse(mesh_.file,
           noun + " " + std::to_string(std::uint64_t{index} + 1) + " in the face of line " +
               std::to_string(face_lines_[face]),
           "one of " + count_of(count, noun));
  }

  [[noreturn]] void refuse_word(std::string_view word, const std::string& expected) const {
    refuse(mesh_.file, quote(word) + " in line " + std::to_string(line_), expected);
  }

  PolygonMesh mesh_;
  std::string joined_;
  std::size_t line_ = 0;
  std::vector<std::size_t> face_lines_;
  bool has_free_forms_ = false;
};

}  // namespace

PolygonMesh read_obj(const std::string& file, std::string_view content) {
  return ObjReader(file).read(content);
}

}  // namespace solidtex::mesh
