// Readers of mesh files. They check every index and count against the file, and allocate memory
// only for data that the file contains. Libraries do not: assimp 5.2 aborts on faces without
// vertices, tinyobjloader reads an invalid number as 0, and tinygltf checks with assert().
#pragma once

#include <filesystem>
#include <string_view>

#include "plugins/mesh/formats/polygon_mesh.h"

namespace solidtex::mesh {

// `content` is the whole file. All throw MeshError, naming `file`. `attribute`: see load_mesh.
PolygonMesh read_ply(const std::string& file, std::string_view content);
PolygonMesh read_ply(const std::string& file, std::string_view content,
                     const std::string& attribute);
PolygonMesh read_obj(const std::string& file, std::string_view content);
PolygonMesh read_stl(const std::string& file, std::string_view content);
PolygonMesh read_off(const std::string& file, std::string_view content);
PolygonMesh read_gltf(const std::string& file, std::string_view content);

// Returns the whole file as bytes.
std::string read_bytes(const std::filesystem::path& file);

}  // namespace solidtex::mesh
