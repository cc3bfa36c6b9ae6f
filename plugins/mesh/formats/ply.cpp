// PLY: any element and property, text and both byte orders.
#include <algorithm>
#include <array>
#include <cmath>

#include "plugins/mesh/formats/ply_body.h"
#include "plugins/mesh/formats/readers.h"

namespace solidtex::mesh {
namespace {

constexpr std::uint32_t kNone = PolygonMesh::kNone;

// The values of one row of an element, by property; of lists as many as there are.
using Row = std::vector<std::vector<double>>;

class PlyReader {
 public:
  PlyReader(const std::string& file, const PlyHeader& header, const std::string& attribute)
      : header_(header) {
    mesh_.file = file;
    const PlyElement* vertices = header.find("vertex");
    if (!vertices || !vertices->find({"x"}) || !vertices->find({"y"}) || !vertices->find({"z"})) {
      refuse(file, "no vertices with x, y and z", "a mesh");
    }
    if (vertices->count >= kNone) refuse(file, count_of(vertices->count, "vertex"), "fewer");
    for (const auto& property : vertices->properties) {
      const bool is_coordinate =
          property.name == "x" || property.name == "y" || property.name == "z";
      if (!is_coordinate || !property.count_type) continue;
      refuse(file, "a list \"" + property.name + "\" of vertices", "one number each");
    }
    vertex_count_ = static_cast<std::uint32_t>(vertices->count);
    coordinates_ = {vertices->find({"x"}), vertices->find({"y"}), vertices->find({"z"})};
    normals_ = {vertices->find({"nx", "normal_x"}), vertices->find({"ny", "normal_y"}),
                vertices->find({"nz", "normal_z"})};
    is_rounded_ = header.format != PlyHeader::Format::ascii &&
                  vertices->properties[*coordinates_[0]].type == PlyType::float32;
    vertex_uvs_ = {vertices->find({"s", "u", "texture_u", "texture_s", "tx", "tu"}),
                   vertices->find({"t", "v", "texture_v", "texture_t", "ty", "tv"})};
    if (!attribute.empty()) find_attribute(*vertices, attribute);
  }

  template <class Body>
  PolygonMesh read(Body body) {
    for (const PlyElement& element : header_.elements) read_element(element, body);
    if (const std::size_t rest = body.bytes_left(); rest > 0) {
      mesh_.warnings.push_back(count_of(rest, "byte") + " after what the header lists left out");
    }
    if (has_images_) {
      mesh_.warnings.push_back("texture coordinates of several images, taken as of one atlas");
    }
    finish();
    return std::move(mesh_);
  }

 private:
  void find_attribute(const PlyElement& vertices, const std::string& name) {
    std::string names;
    for (const PlyProperty& property : vertices.properties) {
      names += (names.empty() ? "" : ", ") + property.name;
    }
    attribute_ = vertices.find({name});
    if (!attribute_) {
      refuse(mesh_.file, "vertices with " + names, "also the attribute " + quote(name));
    }
    const PlyProperty& property = vertices.properties[*attribute_];
    if (property.count_type) {
      refuse(mesh_.file, "a list \"" + name + "\" of vertices", "one number each");
    }
    if (property.type == PlyType::uint8) attribute_scale_ = 1.0 / 255;
    if (property.type == PlyType::uint16) attribute_scale_ = 1.0 / 65535;
  }

  using Handler = void (PlyReader::*)(const PlyElement&, const Row&, std::uint64_t);

  Handler handler_of(const PlyElement& element) const {
    if (element.name == "vertex") return &PlyReader::add_vertex;
    if (element.name == "face") return &PlyReader::add_face;
    if (element.name == "tristrips") return &PlyReader::add_strips;
    return nullptr;
  }

  template <class Body>
  void read_element(const PlyElement& element, Body& body) {
    if (element.properties.empty()) return;
    const Handler handler = handler_of(element);
    Row row(element.properties.size());
    std::uint64_t done = 0;
    try {
      for (; done < element.count; ++done) {
        for (std::size_t i = 0; i < row.size(); ++i) {
          read_property(element, i, body, row[i], done);
        }
        body.end_row();
        if (handler) (this->*handler)(element, row, done);
      }
    } catch (const PlyEnd&) {
      refuse(mesh_.file,
             std::to_string(done) + " of the " + count_of(element.count, element.name) +
                 " that the header promises",
             "all: the file is cut short, copy or export it again");
    }
  }

  template <class Body>
  void read_property(const PlyElement& element, std::size_t index, Body& body,
                     std::vector<double>& values, std::uint64_t number) {
    const PlyProperty& property = element.properties[index];
    values.clear();
    if (!property.count_type) {
      values.push_back(body.take(property.type));
      return;
    }
    const double count = body.take(*property.count_type);
    if (count < 0 || count != std::floor(count)) {
      refuse(mesh_.file,
             "a list \"" + property.name + "\" of " + number_text(count) + " values in " +
                 name_row(element, number),
             "a count");
    }
    for (std::uint64_t i = 0; static_cast<double>(i) < count; ++i)
      values.push_back(body.take(property.type));
  }

  static std::string name_row(const PlyElement& element, std::uint64_t number) {
    return element.name + " " + std::to_string(number);
  }

  static double first(const Row& row, std::size_t property) {
    return row[property].empty() ? 0 : row[property][0];
  }

  void add_vertex(const PlyElement&, const Row& row, std::uint64_t number) {
    mesh_.positions.emplace_back(first(row, *coordinates_[0]), first(row, *coordinates_[1]),
                                 first(row, *coordinates_[2]));
    if (normals_[0] && normals_[1] && normals_[2]) {
      mesh_.normals.emplace_back(first(row, *normals_[0]), first(row, *normals_[1]),
                                 first(row, *normals_[2]));
    }
    if (has_vertex_uvs()) {
      mesh_.uvs.emplace_back(first(row, *vertex_uvs_[0]), first(row, *vertex_uvs_[1]));
    }
    if (attribute_) add_attribute(first(row, *attribute_), number);
  }

  void add_attribute(double value, std::uint64_t vertex) {
    const auto rounded = static_cast<float>(attribute_scale_ * value);
    if (!std::isfinite(rounded)) {
      refuse(mesh_.file,
             number_text(value) + " as an attribute of vertex " + std::to_string(vertex),
             "a finite number");
    }
    mesh_.attribute.push_back(rounded);
  }

  bool has_vertex_uvs() const { return vertex_uvs_[0] && vertex_uvs_[1]; }

  std::uint32_t to_index(double value, const PlyElement& element, std::uint64_t number) const {
    if (value >= 0 && value < vertex_count_ && value == std::floor(value)) {
      return static_cast<std::uint32_t>(value);
    }
    refuse(mesh_.file, "vertex index " + number_text(value) + " in " + name_row(element, number),
           "indices from 0 to below " + std::to_string(vertex_count_));
  }

  void add_corner(std::uint32_t vertex, std::uint32_t uv) {
    mesh_.corners.push_back({vertex, vertex, uv});
  }

  const std::vector<double>& indices_of(const PlyElement& element, const Row& row) const {
    const auto indices = element.find({"vertex_indices", "vertex_index", "vertex_indexes"});
    if (!indices || !element.properties[*indices].count_type) {
      refuse(mesh_.file, "an element \"" + element.name + "\" without vertex indices",
             "a list \"vertex_indices\"");
    }
    return row[*indices];
  }

  void add_face(const PlyElement& element, const Row& row, std::uint64_t number) {
    const std::vector<double>& indices = indices_of(element, row);
    const std::uint32_t uv = add_corner_uvs(element, row, indices.size(), number);
    for (std::uint32_t i = 0; i < indices.size(); ++i) {
      const std::uint32_t vertex = to_index(indices[i], element, number);
      add_corner(vertex, uv != kNone ? uv + i : kNone);
    }
    mesh_.end_face(indices.size());
    if (const auto texture = element.find({"texnumber"})) {
      if (number == 0) image_ = first(row, *texture);
      has_images_ = has_images_ || first(row, *texture) != image_;
    }
  }

  // Index of the first of the face's own texture coordinates, kNone where it has none.
  std::uint32_t add_corner_uvs(const PlyElement& element, const Row& row, std::size_t corner_count,
                               std::uint64_t number) {
    const auto property = element.find({"texcoord", "texcoords", "texture_coordinates"});
    if (!property || row[*property].empty()) return kNone;
    const std::vector<double>& values = row[*property];
    if (values.size() != 2 * corner_count) {
      refuse(mesh_.file,
             count_of(values.size(), "texture coordinate") + " in " + name_row(element, number),
             "two for each of its " + std::to_string(corner_count) + " vertices");
    }
    const auto first_uv = static_cast<std::uint32_t>(corner_uvs_.size());
    for (std::size_t i = 0; i < values.size(); i += 2) {
      corner_uvs_.emplace_back(values[i], values[i + 1]);
    }
    return first_uv;
  }

  // Strips of triangles, one after the other with -1 between.
  void add_strips(const PlyElement& element, const Row& row, std::uint64_t number) {
    std::vector<std::uint32_t> strip;
    for (const double value : indices_of(element, row)) {
      if (value == -1 || value == std::numeric_limits<std::uint32_t>::max()) {
        strip.clear();
        continue;
      }
      strip.push_back(to_index(value, element, number));
      const std::size_t count = strip.size();
      if (count < 3) continue;
      const std::uint32_t a = strip[count - 3], b = strip[count - 2], c = strip[count - 1];
      if (a == b || b == c || c == a) continue;  // leads to where the strip goes on
      const bool is_even = count % 2 != 0;
      for (const std::uint32_t vertex : {is_even ? a : b, is_even ? b : a, c}) {
        add_corner(vertex, kNone);
      }
      mesh_.end_face(3);
    }
  }

  void finish() {
    for (const PolygonMesh::Corner& corner : mesh_.corners) {
      if (!is_rounded_) break;
      const glm::dvec3 size = glm::abs(mesh_.positions[corner.position]);
      mesh_.rounding_error =
          std::max(mesh_.rounding_error, 0x1p-24 * std::max({size.x, size.y, size.z}));
    }
    if (!corner_uvs_.empty()) {
      mesh_.uvs = std::move(corner_uvs_);
      return;
    }
    mesh_.keeps_vertices = true;
    for (PolygonMesh::Corner& corner : mesh_.corners) corner.uv = corner.position;
  }

  const PlyHeader& header_;
  PolygonMesh mesh_;
  std::uint32_t vertex_count_ = 0;
  std::array<std::optional<std::size_t>, 3> coordinates_, normals_;
  std::array<std::optional<std::size_t>, 2> vertex_uvs_;
  std::optional<std::size_t> attribute_;
  double attribute_scale_ = 1;
  std::vector<glm::vec2> corner_uvs_;
  double image_ = 0;
  bool has_images_ = false, is_rounded_ = false;
};

}  // namespace

PolygonMesh read_ply(const std::string& file, std::string_view content) {
  return read_ply(file, content, "");
}

PolygonMesh read_ply(const std::string& file, std::string_view content,
                     const std::string& attribute) {
  const PlyHeader header = take_ply_header(file, content);
  PlyReader reader(file, header, attribute);
  if (header.format == PlyHeader::Format::ascii) return reader.read(PlyAsciiBody(file, content));
  const bool is_big_endian = header.format == PlyHeader::Format::big_endian;
  return reader.read(PlyBinaryBody(content, is_big_endian));
}

}  // namespace solidtex::mesh
