#include "tools/bake/ply.h"

#include <bit>
#include <cstdint>
#include <set>
#include <stdexcept>

#include "tools/bake/channels.h"
#include "tools/common/output_file.h"

namespace solidtex::tools {
namespace {

using mesh::Mesh;

// Single precision suffices near zero only.
bool needs_doubles(const Mesh& mesh) { return mesh.origin != glm::dvec3(0); }

std::string header_of(const Mesh& mesh, const std::vector<PlyProperty>& properties) {
  std::string text = "ply\nformat binary_";
  text += std::endian::native == std::endian::little ? "little" : "big";
  text += "_endian 1.0\ncomment made by solidtex-bake\nelement vertex " +
          std::to_string(mesh.positions.size()) + "\n";
  std::set<std::string> names;
  const auto add = [&](const std::string& type, const std::string& name) {
    if (!names.insert(name).second || name.find_first_of(" \t\r\n") != std::string::npos) {
      throw std::runtime_error("the model has a channel \"" + name +
                               "\", expected a name without spaces that PLY does not use itself");
    }
    text += "property " + type + " " + name + "\n";
  };
  for (const char* name : {"x", "y", "z"}) add(needs_doubles(mesh) ? "double" : "float", name);
  if (!mesh.normals.empty()) {
    for (const char* name : {"nx", "ny", "nz"}) add("float", name);
  }
  if (!mesh.uvs.empty()) {
    for (const char* name : {"s", "t"}) add("float", name);
  }
  for (const PlyProperty& property : properties) {
    add(property.is_byte ? "uchar" : "float", property.name);
  }
  return text + "element face " + std::to_string(mesh.triangles.size()) +
         "\nproperty list uchar uint vertex_indices\nend_header\n";
}

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void append_vertex(std::string& bytes, const Mesh& mesh, const std::vector<PlyProperty>& properties,
                   std::size_t vertex) {
  if (needs_doubles(mesh)) {
    append(bytes, mesh.position(vertex));
  } else {
    append(bytes, mesh.positions[vertex]);
  }
  if (!mesh.normals.empty()) append(bytes, mesh.normals[vertex]);
  if (!mesh.uvs.empty()) append(bytes, mesh.uvs[vertex]);
  for (const PlyProperty& property : properties) {
    const float value = property.values[vertex];
    if (property.is_byte) {
      append(bytes, quantize<std::uint8_t>(value));
    } else {
      append(bytes, value);
    }
  }
}

}  // namespace

void write_ply(const std::filesystem::path& path, const Mesh& mesh,
               const std::vector<PlyProperty>& properties) {
  std::string bytes = header_of(mesh, properties);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) append_vertex(bytes, mesh, properties, v);
  for (const glm::uvec3& triangle : mesh.triangles) {
    append(bytes, std::uint8_t{3});
    append(bytes, triangle);
  }
  OutputFile file(path);
  file.write(0, bytes.data(), bytes.size());
  file.close();
}

}  // namespace solidtex::tools
