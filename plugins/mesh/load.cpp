#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <cmath>
#include <fstream>
#include <limits>

#include "plugins/mesh/mesh.h"

namespace solidtex::mesh {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& found,
                         const std::string& expected) {
  throw MeshError(file.string() + ": found " + found + ", expected " + expected);
}

bool is_finite(const aiVector3D& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

// Before assimp itself touches the data again: its importers do not check all of this.
void check_part(const aiMesh& part, const std::filesystem::path& file) {
  for (unsigned i = 0; i < part.mNumVertices; ++i) {
    const aiVector3D& v = part.mVertices[i];
    if (!is_finite(v)) {
      refuse(file,
             "vertex " + std::to_string(i) + " at (" + std::to_string(v.x) + ", " +
                 std::to_string(v.y) + ", " + std::to_string(v.z) + ")",
             "finite coordinates");
    }
  }
  for (unsigned f = 0; f < part.mNumFaces; ++f) {
    const aiFace& face = part.mFaces[f];
    for (unsigned c = 0; c < face.mNumIndices; ++c) {
      if (face.mIndices[c] >= part.mNumVertices) {
        refuse(file,
               "vertex index " + std::to_string(face.mIndices[c]) + " in face " + std::to_string(f),
               "indices below " + std::to_string(part.mNumVertices));
      }
    }
  }
}

// Assimp never comes back from a header without an end.
void check_ply_header(const std::filesystem::path& file) {
  constexpr int kMaxLines = 1000;
  std::ifstream stream(file, std::ios::binary);
  std::string line;
  for (int i = 0; i < kMaxLines && std::getline(stream, line); ++i) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line == "end_header") return;
  }
  refuse(file, "a header without an end", "\"end_header\" in a line of its own");
}

glm::vec3 to_glm(const aiVector3D& v) { return {v.x, v.y, v.z}; }

void append_part(Mesh& mesh, const aiMesh& part) {
  const auto first = static_cast<unsigned>(mesh.positions.size());
  for (unsigned i = 0; i < part.mNumVertices; ++i) {
    mesh.positions.push_back(to_glm(part.mVertices[i]));
    if (part.HasNormals()) mesh.normals.push_back(to_glm(part.mNormals[i]));
    if (part.HasTextureCoords(0)) {
      mesh.uvs.emplace_back(part.mTextureCoords[0][i].x, part.mTextureCoords[0][i].y);
    }
  }
  for (unsigned f = 0; f < part.mNumFaces; ++f) {
    const aiFace& face = part.mFaces[f];
    if (face.mNumIndices != 3) continue;  // points and lines have no surface
    mesh.triangles.emplace_back(first + face.mIndices[0], first + face.mIndices[1],
                                first + face.mIndices[2]);
  }
}

// Attributes that only some parts of a file have, or that are not finite, are dropped.
template <class T>
void keep_if_complete(std::vector<T>& values, std::size_t count) {
  bool usable = values.size() == count;
  for (const T& value : values) usable = usable && std::isfinite(glm::dot(value, value));
  if (!usable) values.clear();
}

}  // namespace

Mesh load_mesh(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file)) refuse(file, "no such file", "an OBJ or PLY mesh");
  const std::string extension = file.extension().string();
  if (extension != ".obj" && extension != ".ply") {
    refuse(file, "a file named *" + extension, "*.obj or *.ply");
  }
  if (extension == ".ply") check_ply_header(file);
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(file.string(), 0);
  if (!scene) {
    refuse(file, std::string("what cannot be read (") + importer.GetErrorString() + ")",
           "a valid mesh");
  }
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) check_part(*scene->mMeshes[m], file);
  scene = importer.ApplyPostProcessing(aiProcess_Triangulate);
  if (!scene) refuse(file, "faces that cannot be split into triangles", "polygons");

  Mesh mesh;
  mesh.file = file.string();
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) append_part(mesh, *scene->mMeshes[m]);
  if (mesh.triangles.empty()) refuse(file, "no triangles", "at least one");
  keep_if_complete(mesh.normals, mesh.positions.size());
  keep_if_complete(mesh.uvs, mesh.positions.size());
  return mesh;
}

}  // namespace solidtex::mesh
