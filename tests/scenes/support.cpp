#include "tests/scenes/support.h"

#include <unistd.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <fstream>
#include <glm/gtc/constants.hpp>
#include <iostream>
#include <sstream>

#include "catch.hpp"

namespace scene_tests {
namespace fs = std::filesystem;

TemporaryFolder::TemporaryFolder() {
  static std::atomic<int> count = 0;
  path_ = fs::temp_directory_path() /
          ("solidtex-scenes-" + std::to_string(getpid()) + "-" + std::to_string(count++));
  fs::create_directories(path_);
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

void write_text(const fs::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}

std::string read_text(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

pt::Mesh make_sphere(int rows, float radius) {
  pt::Mesh mesh;
  mesh.file = "sphere";
  const int columns = 2 * rows;
  for (int i = 0; i <= rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      const float polar = glm::pi<float>() * static_cast<float>(i) / static_cast<float>(rows);
      const float angle =
          glm::two_pi<float>() * static_cast<float>(j) / static_cast<float>(columns);
      const float ring = i == 0 || i == rows ? 0 : std::sin(polar);
      mesh.positions.push_back(
          radius * glm::vec3(ring * std::cos(angle), std::cos(polar), ring * std::sin(angle)));
    }
  }
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      const auto at = [&](int row, int column) {
        return static_cast<unsigned>(row * columns + column % columns);
      };
      if (i + 1 < rows) mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
      if (i > 0) mesh.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
    }
  }
  return mesh;
}

pt::Mesh make_quad(float half_size) {
  const float h = half_size;
  return {"quad",
          {{-h, 0, -h}, {-h, 0, h}, {h, 0, h}, {h, 0, -h}},
          {},
          {{0, 1}, {0, 0}, {1, 0}, {1, 1}},
          {{0, 1, 2}, {0, 2, 3}}};
}

pt::Mesh make_cube() {
  pt::Mesh mesh;
  mesh.file = "cube";
  for (int i = 0; i < 8; ++i) {
    mesh.positions.emplace_back(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
  }
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

double signed_volume(const pt::Mesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    sum += glm::dot(glm::dvec3(mesh.positions[t.x]),
                    glm::cross(glm::dvec3(mesh.positions[t.y]), glm::dvec3(mesh.positions[t.z])));
  }
  return sum / 6;
}

bool built_with_cgal() {
  if (!pt::can_repair_meshes()) WARN("not tested: this build has no CGAL");
  return pt::can_repair_meshes();
}

void write_ply(const fs::path& file, const pt::Mesh& mesh) {
  std::ostringstream text;
  text.precision(9);
  text << "ply\nformat ascii 1.0\nelement vertex " << mesh.positions.size()
       << "\nproperty float x\nproperty float y\nproperty float z\nelement face "
       << mesh.triangles.size() << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const auto& p : mesh.positions) text << p.x << ' ' << p.y << ' ' << p.z << '\n';
  for (const auto& t : mesh.triangles) text << "3 " << t.x << ' ' << t.y << ' ' << t.z << '\n';
  write_text(file, text.str());
}

void write_obj(const fs::path& file, const pt::Mesh& mesh) {
  std::ostringstream text;
  text.precision(9);
  for (const auto& p : mesh.positions) text << "v " << p.x << ' ' << p.y << ' ' << p.z << '\n';
  for (const auto& uv : mesh.uvs) text << "vt " << uv.x << ' ' << uv.y << '\n';
  for (const auto& t : mesh.triangles) {
    text << 'f';
    for (int c = 0; c < 3; ++c) {
      text << ' ' << t[c] + 1;
      if (!mesh.uvs.empty()) text << '/' << t[c] + 1;
    }
    text << '\n';
  }
  write_text(file, text.str());
}

void write_noise_model(const fs::path& file, int level, const std::vector<std::string>& channels) {
  using nlohmann::json;
  json nodes = json::array();
  nodes.push_back({{"name", "level" + std::to_string(level)},
                   {"op", "noise"},
                   {"level", level},
                   {"channels", channels.size()},
                   {"distribution", "uniform"}});
  for (int k = level; k > 0; --k) {
    nodes.push_back({{"name", "level" + std::to_string(k - 1)},
                     {"op", "upsample"},
                     {"inputs", {"level" + std::to_string(k)}}});
  }
  const json document = {{"version", 1},
                         {"name", "noise"},
                         {"family", "field"},
                         {"channels", channels},
                         {"color_space", "srgb"},
                         {"noise", {{"scheme", "solidtex-1"}}},
                         {"field", {{"nodes", nodes}, {"output", "level0"}}}};
  const std::string header = json{{"__metadata__", {{"solidtex", document.dump()}}}}.dump();
  const std::uint64_t length = header.size();
  std::string bytes(sizeof length, '\0');
  std::memcpy(bytes.data(), &length, sizeof length);
  write_text(file, bytes + header);
}

pt::Scene make_scene(pt::Mesh mesh, pt::Material material, const glm::vec3& eye, float fov) {
  pt::Scene scene;
  scene.camera = {eye, glm::vec3(0), {0, 1, 0}, fov};
  scene.meshes.push_back(std::move(mesh));
  scene.materials.push_back(std::move(material));
  scene.objects.push_back({});
  return scene;
}

pt::EnvironmentImage uniform_light(const glm::vec3& radiance) {
  return {{"", 1, 1, {radiance}}, 0};
}

pt::RenderSettings small_settings(int size, int samples) {
  pt::RenderSettings settings;
  settings.width = settings.height = size;
  settings.samples = samples;
  return settings;
}

glm::vec3 mean_color(const pt::Image& image) {
  glm::dvec3 sum(0);
  for (std::size_t i = 0; i < image.rgb.size(); i += 3) {
    sum += glm::dvec3(image.rgb[i], image.rgb[i + 1], image.rgb[i + 2]);
  }
  return glm::vec3(sum / static_cast<double>(image.rgb.size() / 3));
}

glm::vec3 middle_color(const pt::Image& image, int half_size) {
  glm::dvec3 sum(0);
  for (int y = image.height / 2 - half_size; y < image.height / 2 + half_size; ++y) {
    for (int x = image.width / 2 - half_size; x < image.width / 2 + half_size; ++x) {
      const auto i = static_cast<std::size_t>(y * image.width + x) * 3;
      sum += glm::dvec3(image.rgb[i], image.rgb[i + 1], image.rgb[i + 2]);
    }
  }
  return glm::vec3(sum / static_cast<double>(4 * half_size * half_size));
}

bool save_unless(bool passed, const pt::Image& image, const std::string& name) {
  if (!passed) {
    fs::create_directories(SOLIDTEX_TEST_OUTPUT);
    const fs::path file = fs::path(SOLIDTEX_TEST_OUTPUT) / (name + ".exr");
    pt::write_exr(image, file);
    std::cerr << "image of the failed test: " << file.string() << '\n';
  }
  return passed;
}

}  // namespace scene_tests
