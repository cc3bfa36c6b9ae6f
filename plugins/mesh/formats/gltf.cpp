// glTF 2.0: the triangles of a scene's nodes, where the nodes put them.
#include <algorithm>
#include <array>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>

#include "plugins/mesh/formats/gltf_buffers.h"
#include "plugins/mesh/formats/readers.h"
#include "plugins/mesh/formats/text.h"

namespace solidtex::mesh {
namespace {

using nlohmann::json;

constexpr std::uint64_t kMissing = ~0ull;
constexpr std::size_t kMaxCorners = 1u << 28;  // nodes may repeat a mesh without end

// Extensions that change nothing about triangles.
constexpr std::array<std::string_view, 6> kHarmless = {"KHR_mesh_quantization", "KHR_materials_",
                                                       "KHR_texture_",          "EXT_texture_",
                                                       "KHR_lights_",           "KHR_xmp"};

class GltfReader {
 public:
  explicit GltfReader(const GltfDocument& document) : document_(document) {
    mesh_.file = document.file();
  }

  PolygonMesh read() {
    check_extensions();
    visited_.resize(array_size("nodes"));
    for (const std::uint64_t root : root_nodes()) pending_.push_back({root, glm::dmat4(1)});
    while (!pending_.empty()) {
      const Node node = pending_.back();
      pending_.pop_back();
      visit(node);
    }
    if (has_skins_) mesh_.warnings.push_back("skins left out: the mesh is not posed");
    if (has_instances_) {
      mesh_.warnings.push_back("instances left out: each of their meshes is read once");
    }
    return std::move(mesh_);
  }

 private:
  struct Node {
    std::uint64_t index;
    glm::dmat4 to_parent;
  };

  std::size_t array_size(const char* name) const {
    const auto found = document_.root().find(name);
    return found != document_.root().end() && found->is_array() ? found->size() : 0;
  }

  void check_extensions() const {
    const auto required = document_.root().find("extensionsRequired");
    if (required == document_.root().end() || !required->is_array()) return;
    for (const json& extension : *required) {
      const std::string name = extension.is_string() ? extension.get<std::string>() : "";
      const auto is_known = [&](std::string_view known) { return name.starts_with(known); };
      if (std::ranges::any_of(kHarmless, is_known)) continue;
      document_.refuse("the extension \"" + name + "\", which the file requires",
                       "plain triangles: export it without compression");
    }
  }

  std::vector<std::uint64_t> indices(const json& object, const char* name) const {
    std::vector<std::uint64_t> result;
    const auto found = object.find(name);
    if (found == object.end()) return result;
    for (const json& index : *found) {
      if (!index.is_number_unsigned())
        document_.refuse("no index in \"" + std::string(name) + "\"", "numbers");
      result.push_back(index.get<std::uint64_t>());
    }
    return result;
  }

  // Returns the root nodes of the default scene; without scenes the nodes without a parent.
  std::vector<std::uint64_t> root_nodes() const {
    if (array_size("scenes") > 0) {
      const std::uint64_t scene = document_.number(document_.root(), "scene", 0);
      return indices(document_.element("scenes", scene), "nodes");
    }
    std::vector<bool> is_child(array_size("nodes"));
    for (std::size_t i = 0; i < is_child.size(); ++i) {
      for (const std::uint64_t child : indices(document_.element("nodes", i), "children")) {
        if (child < is_child.size()) is_child[child] = true;
      }
    }
    std::vector<std::uint64_t> roots;
    for (std::size_t i = 0; i < is_child.size(); ++i) {
      if (!is_child[i]) roots.push_back(i);
    }
    return roots;
  }

  void visit(const Node& node) {
    const json& object = document_.element("nodes", node.index);
    if (visited_[node.index]) {
      document_.refuse("the node " + std::to_string(node.index) + " twice", "a tree of nodes");
    }
    visited_[node.index] = true;
    has_skins_ = has_skins_ || object.contains("skin");
    const auto extensions = object.find("extensions");
    has_instances_ = has_instances_ || (extensions != object.end() &&
                                        extensions->contains("EXT_mesh_gpu_instancing"));
    const glm::dmat4 transform = node.to_parent * transform_of(object);
    if (object.contains("mesh")) add_mesh(document_.number(object, "mesh", 0), transform);
    for (const std::uint64_t child : indices(object, "children")) {
      pending_.push_back({child, transform});
    }
  }

  template <std::size_t kCount>
  std::array<double, kCount> numbers(const json& object, const char* name,
                                     std::array<double, kCount> otherwise) const {
    const auto found = object.find(name);
    if (found == object.end()) return otherwise;
    const auto is_number = [](const json& value) { return value.is_number(); };
    if (!found->is_array() || found->size() != kCount || !std::ranges::all_of(*found, is_number)) {
      document_.refuse("a \"" + std::string(name) + "\" of another length",
                       std::to_string(kCount) + " numbers");
    }
    return found->get<std::array<double, kCount>>();
  }

  glm::dmat4 transform_of(const json& node) const {
    if (node.contains("matrix")) {
      return glm::make_mat4(numbers<16>(node, "matrix", {}).data());
    }
    const auto t = numbers<3>(node, "translation", {0, 0, 0});
    const auto r = numbers<4>(node, "rotation", {0, 0, 0, 1});
    const auto s = numbers<3>(node, "scale", {1, 1, 1});
    glm::dmat4 transform = glm::mat4_cast(glm::normalize(glm::dquat(r[3], r[0], r[1], r[2])));
    for (int axis = 0; axis < 3; ++axis) transform[axis] *= s[static_cast<std::size_t>(axis)];
    transform[3] = glm::dvec4(t[0], t[1], t[2], 1);
    return transform;
  }

  void add_mesh(std::uint64_t index, const glm::dmat4& transform) {
    const auto& mesh = document_.element("meshes", index);
    const auto primitives = mesh.find("primitives");
    if (primitives == mesh.end()) return;
    for (const json& primitive : *primitives) {
      if (!primitive.is_object()) document_.refuse("a primitive that is no object", "one");
      add_primitive(primitive, transform);
    }
  }

  // Mode 4 is triangles, 5 a strip, 6 a fan; others are points and lines.
  void add_primitive(const json& primitive, const glm::dmat4& transform) {
    const std::uint64_t mode = document_.number(primitive, "mode", 4);
    const auto attributes = primitive.find("attributes");
    if (mode < 4 || mode > 6 || attributes == primitive.end() || !attributes->is_object()) return;
    const std::uint64_t positions = document_.number(*attributes, "POSITION", kMissing);
    if (positions == kMissing) return;
    const PolygonMesh::Corner base = add_vertices(*attributes, positions, transform);
    const std::size_t count = mesh_.positions.size() - base.position;
    const std::vector<std::uint32_t> vertices = vertices_of(primitive, count);
    const bool is_mirrored = glm::determinant(glm::dmat3(transform)) < 0;
    const std::size_t step = mode == 4 ? 3 : 1;
    for (std::size_t i = 0; i + 2 < vertices.size(); i += step) {
      const std::size_t first = mode == 6 ? 0 : i;
      const bool is_turned = is_mirrored != (mode == 5 && i % 2 == 1);
      add_triangle(base, vertices[first], vertices[i + (is_turned ? 2 : 1)],
                   vertices[i + (is_turned ? 1 : 2)]);
    }
    if (mesh_.corners.size() > kMaxCorners) {
      document_.refuse("more than " + std::to_string(kMaxCorners / 3) + " triangles", "fewer");
    }
  }

  // Where its vertices begin.
  PolygonMesh::Corner add_vertices(const json& attributes, std::uint64_t accessor,
                                   const glm::dmat4& transform) {
    PolygonMesh::Corner base{static_cast<std::uint32_t>(mesh_.positions.size())};
    const GltfArray positions = document_.array(accessor, 3);
    for (std::size_t i = 0; i < positions.count; ++i) {
      const glm::dvec3 p(positions.at(i, 0), positions.at(i, 1), positions.at(i, 2));
      const glm::dvec3 size = glm::abs(p);
      mesh_.rounding_error =
          std::max({mesh_.rounding_error, 0x1p-24 * size.x, 0x1p-24 * size.y, 0x1p-24 * size.z});
      mesh_.positions.emplace_back(transform * glm::dvec4(p, 1));
    }
    const glm::dmat3 to_normal = glm::transpose(glm::inverse(glm::dmat3(transform)));
    if (const auto normals = attribute(attributes, "NORMAL", 3, positions.count)) {
      base.normal = static_cast<std::uint32_t>(mesh_.normals.size());
      for (std::size_t i = 0; i < normals->count; ++i) {
        const glm::dvec3 n(normals->at(i, 0), normals->at(i, 1), normals->at(i, 2));
        const glm::dvec3 turned = to_normal * n;
        const double length = glm::length(turned);
        mesh_.normals.emplace_back(length > 0 ? turned / length : glm::dvec3(0));
      }
    }
    if (const auto uvs = attribute(attributes, "TEXCOORD_0", 2, positions.count)) {
      base.uv = static_cast<std::uint32_t>(mesh_.uvs.size());
      for (std::size_t i = 0; i < uvs->count; ++i) {
        mesh_.uvs.emplace_back(uvs->at(i, 0), 1 - uvs->at(i, 1));  // v goes down in glTF
      }
    }
    return base;
  }

  std::optional<GltfArray> attribute(const json& attributes, const char* name, int width,
                                     std::size_t count) const {
    const std::uint64_t accessor = document_.number(attributes, name, kMissing);
    if (accessor == kMissing) return std::nullopt;
    const GltfArray array = document_.array(accessor, width);
    if (array.count != count) {
      document_.refuse(count_of(array.count, "element") + " of " + name,
                       std::to_string(count) + ", one for each vertex");
    }
    return array;
  }

  std::vector<std::uint32_t> vertices_of(const json& primitive, std::size_t count) const {
    std::vector<std::uint32_t> vertices;
    const std::uint64_t accessor = document_.number(primitive, "indices", kMissing);
    if (accessor == kMissing) {
      for (std::uint32_t i = 0; i < count; ++i) vertices.push_back(i);
      return vertices;
    }
    const GltfArray indices = document_.array(accessor, 1);
    vertices.reserve(indices.count);
    for (std::size_t i = 0; i < indices.count; ++i) {
      const double index = indices.at(i, 0);
      if (!(index >= 0 && index < static_cast<double>(count))) {
        document_.refuse("vertex index " + number_text(index) + " in face " + std::to_string(i / 3),
                         "indices from 0 to below " + std::to_string(count));
      }
      vertices.push_back(static_cast<std::uint32_t>(index));
    }
    return vertices;
  }

  void add_triangle(const PolygonMesh::Corner& base, std::uint32_t a, std::uint32_t b,
                    std::uint32_t c) {
    const auto shifted = [](std::uint32_t first, std::uint32_t vertex) {
      return first == PolygonMesh::kNone ? first : first + vertex;
    };
    for (const std::uint32_t vertex : {a, b, c}) {
      mesh_.corners.push_back(
          {base.position + vertex, shifted(base.normal, vertex), shifted(base.uv, vertex)});
    }
    mesh_.end_face(3);
  }

  const GltfDocument& document_;
  PolygonMesh mesh_;
  std::vector<bool> visited_;
  bool has_skins_ = false, has_instances_ = false;
  std::vector<Node> pending_;
};

}  // namespace

PolygonMesh read_gltf(const std::string& file, std::string_view content) {
  return GltfReader(GltfDocument(file, content)).read();
}

}  // namespace solidtex::mesh
