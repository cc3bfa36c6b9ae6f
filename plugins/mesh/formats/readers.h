// The readers of mesh files. They own no resources and trust nothing: every index and count is
// checked against what the file holds, and memory is taken for what it holds only. Ours, because
// assimp 5.2 aborts on faces without vertices, tinyobjloader reads a number that it does not
// understand as 0, and tinygltf checks with assert().
#pragma once

#include <filesystem>
#include <string_view>

#include "plugins/mesh/formats/polygon_mesh.h"

namespace solidtex::mesh {

// All throw MeshError, naming `file`; `content` is all of its bytes.
PolygonMesh read_ply(const std::string& file, std::string_view content);
PolygonMesh read_obj(const std::string& file, std::string_view content);
PolygonMesh read_stl(const std::string& file, std::string_view content);
PolygonMesh read_off(const std::string& file, std::string_view content);
PolygonMesh read_gltf(const std::string& file, std::string_view content);

// The whole file as bytes.
std::string read_bytes(const std::filesystem::path& file);

}  // namespace solidtex::mesh
