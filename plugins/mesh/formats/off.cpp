// OFF: the text format of Geomview, with normals or texture coordinates of vertices.
#include <vector>

#include "plugins/mesh/formats/readers.h"
#include "plugins/mesh/formats/text.h"

namespace solidtex::mesh {
namespace {

class OffReader {
 public:
  OffReader(const std::string& file, std::string_view content)
      : file_(file), rest_(without_bom(content)) {
    mesh_.file = file;
    mesh_.keeps_vertices = true;
  }

  PolygonMesh read() {
    const Counts counts = read_header();
    for (std::uint64_t v = 0; v < counts.vertices; ++v) read_vertex(v, counts.vertices);
    for (std::uint64_t f = 0; f < counts.faces; ++f) read_face(f, counts);
    std::uint64_t left = 0;
    while (!take_content_line().empty()) ++left;
    if (left > 0) {
      mesh_.warnings.push_back(count_of(left, "line") + " after what the header counts left out");
    }
    return std::move(mesh_);
  }

 private:
  struct Counts {
    std::uint64_t vertices = 0, faces = 0;
  };

  // The next line that says something; empty at the end of the file.
  std::string_view take_content_line() {
    while (!rest_.empty()) {
      std::string_view line = take_line(rest_);
      ++line_;
      line = line.substr(0, line.find('#'));
      std::string_view words = line;
      if (!take_word(words).empty()) return line;
    }
    return {};
  }

  // "OFF", with letters for what vertices have: ST texture coordinates, C colors, N normals.
  Counts read_header() {
    std::string_view line = take_content_line();
    const std::string_view keyword = take_word(line);
    const bool is_off = keyword.ends_with("OFF");
    const std::string_view letters = keyword.substr(0, keyword.size() - (is_off ? 3 : 0));
    has_uvs_ = letters.starts_with("ST");
    has_normals_ = letters.ends_with('N');
    const bool is_known = letters == "" || letters == "N" || letters == "C" || letters == "CN" ||
                          letters == "ST" || letters == "STN" || letters == "STC" ||
                          letters == "STCN";
    std::string_view words = line;
    if (!is_off || !is_known || take_word(words) == "BINARY") {
      refuse(file_, quote(keyword) + " in line 1", "a text file with OFF, NOFF, COFF or STOFF");
    }
    has_colors_ = letters.find('C') != letters.npos;
    words = line;
    if (take_word(words).empty()) line = take_content_line();
    const double vertices = take_number(line), faces = take_number(line);
    if (!(vertices >= 0 && vertices < PolygonMesh::kNone && faces >= 0 && faces < 0x1p53)) {
      refuse(file_, "counts in line " + std::to_string(line_), "those of vertices and faces");
    }
    return {static_cast<std::uint64_t>(vertices), static_cast<std::uint64_t>(faces)};
  }

  double take_number(std::string_view& line) const {
    const std::string_view word = take_word(line);
    const auto number = to_number(word);
    if (!number) refuse(file_, quote(word) + " in line " + std::to_string(line_), "a number");
    return *number;
  }

  std::string_view take_row(std::uint64_t done, std::uint64_t all, const std::string& noun) {
    const std::string_view line = take_content_line();
    if (!line.empty()) return line;
    refuse(file_,
           std::to_string(done) + " of the " + count_of(all, noun) + " that the header promises",
           "all: the file is cut short, copy or export it again");
  }

  glm::dvec3 take_vector(std::string_view& line) const {
    glm::dvec3 vector;
    for (int axis = 0; axis < 3; ++axis) vector[axis] = take_number(line);
    return vector;
  }

  // Position, normal, color, texture coordinates: the last two are the line's last words.
  void read_vertex(std::uint64_t number, std::uint64_t count) {
    std::string_view line = take_row(number, count, "vertex");
    mesh_.positions.push_back(take_vector(line));
    if (has_normals_) mesh_.normals.emplace_back(take_vector(line));
    if (!has_uvs_) return;
    std::vector<double> rest;
    for (std::string_view words = line; !take_word(words).empty(); line = words) {
      rest.push_back(take_number(line));
    }
    if (rest.size() < 2 || (!has_colors_ && rest.size() > 2)) {
      refuse(file_, count_of(rest.size(), "number") + " in line " + std::to_string(line_),
             "two texture coordinates");
    }
    mesh_.uvs.emplace_back(rest[rest.size() - 2], rest[rest.size() - 1]);
  }

  // What comes behind the indices is the face's color.
  void read_face(std::uint64_t number, const Counts& counts) {
    std::string_view line = take_row(number, counts.faces, "face");
    const double size = take_number(line);
    std::size_t done = 0;
    for (; static_cast<double>(done) < size; ++done) {
      const std::string_view word = take_word(line);
      const auto index = to_integer(word);
      if (!index || *index < 0 || static_cast<std::uint64_t>(*index) >= counts.vertices) {
        refuse(file_, "vertex index " + quote(word) + " in face " + std::to_string(number),
               "indices from 0 to below " + std::to_string(counts.vertices) +
                   (rest_.empty() ? ": is the file cut short? Copy or export it again" : ""));
      }
      const auto vertex = static_cast<std::uint32_t>(*index);
      mesh_.corners.push_back({vertex, vertex, vertex});
    }
    mesh_.end_face(done);
  }

  const std::string& file_;
  std::string_view rest_;
  std::size_t line_ = 0;
  PolygonMesh mesh_;
  bool has_normals_ = false, has_uvs_ = false, has_colors_ = false;
};

}  // namespace

PolygonMesh read_off(const std::string& file, std::string_view content) {
  return OffReader(file, content).read();
}

}  // namespace solidtex::mesh
