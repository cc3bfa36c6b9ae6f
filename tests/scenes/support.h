// What the scene tests share: small meshes, scenes built in memory, files, image comparison.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "plugins/pathtracer/scene/scene.h"

namespace scene_tests {

namespace pt = solidtex::pathtracer;

// A folder of its own for one test, empty at the start and removed at the end.
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

// Meshes without normals: flat faces.
pt::Mesh make_sphere(int rows, float radius = 1);
pt::Mesh make_quad(float half_size);  // in the plane y = 0, with UVs from 0 to 1
pt::Mesh make_cube();                 // from -1 to 1
void write_ply(const std::filesystem::path& file, const pt::Mesh& mesh);
void write_obj(const std::filesystem::path& file, const pt::Mesh& mesh);

// Volume by the divergence theorem: positive when the faces are turned outward.
double signed_volume(const pt::Mesh& mesh);

// Whether meshes can be repaired and cut; warns that something is not tested where they cannot.
bool built_with_cgal();

// A valid model without parameters: uniform noise that is constant in cubes of 2^level texels.
void write_noise_model(const std::filesystem::path& file, int level,
                       const std::vector<std::string>& channels = {"albedo.r", "albedo.g",
                                                                   "albedo.b"});

// One object seen by a camera at `eye` that looks at the origin.
pt::Scene make_scene(pt::Mesh mesh, pt::Material material, const glm::vec3& eye, float fov);
pt::EnvironmentImage uniform_light(const glm::vec3& radiance);
pt::RenderSettings small_settings(int size, int samples);

glm::vec3 mean_color(const pt::Image& image);

// Mean over a square around the middle of the picture.
glm::vec3 middle_color(const pt::Image& image, int half_size);

// Saves the picture for a look when `passed` is false; returns `passed`.
bool save_unless(bool passed, const pt::Image& image, const std::string& name);

}  // namespace scene_tests
