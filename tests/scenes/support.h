// Shared by the scene tests: small meshes, scenes in memory, files, image comparison.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "plugins/pathtracer/scene/scene.h"

namespace scene_tests {

namespace pt = solidtex::pathtracer;

// A temporary folder, removed by the destructor.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

void write_text(const std::filesystem::path& file, const std::string& text);
std::string read_text(const std::filesystem::path& file);

// Meshes without normals, with flat faces.
pt::Mesh make_sphere(int rows, float radius = 1);
pt::Mesh make_quad(float half_size);  // in the plane y = 0, with UVs from 0 to 1
pt::Mesh make_cube();                 // from -1 to 1
void write_ply(const std::filesystem::path& file, const pt::Mesh& mesh);
void write_obj(const std::filesystem::path& file, const pt::Mesh& mesh);

// Volume by the divergence theorem, positive if the faces point outward.
double signed_volume(const pt::Mesh& mesh);

// Whether meshes can be repaired and cut. Warns of skipped tests if not.
bool built_with_cgal();

// Writes a valid model without parameters: uniform noise, constant in cubes of 2^level texels.
void write_noise_model(const std::filesystem::path& file, int level,
                       const std::vector<std::string>& channels = {"albedo.r", "albedo.g",
                                                                   "albedo.b"});

// One object and a camera at `eye` that looks at the origin.
pt::Scene make_scene(pt::Mesh mesh, pt::Material material, const glm::vec3& eye, float fov);
pt::EnvironmentImage uniform_light(const glm::vec3& radiance);
pt::RenderSettings small_settings(int size, int samples);

glm::vec3 mean_color(const pt::Image& image);

// Mean over a square in the image's center.
glm::vec3 middle_color(const pt::Image& image, int half_size);

// Saves the image for inspection if `passed` is false. Returns `passed`.
bool save_unless(bool passed, const pt::Image& image, const std::string& name);

}  // namespace scene_tests
