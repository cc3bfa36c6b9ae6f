// A scene as plain data: everything is loaded, checked and in linear light. No behaviour here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <solidtex/pathtracer.hpp>
#include <solidtex/solidtex.hpp>
#include <string>
#include <variant>
#include <vector>

#include "plugins/pathtracer/geometry/mesh.h"

namespace solidtex::pathtracer {

// A pixel grid with linear colours; row 0 is the top.
struct ColorImage {
  std::string file;
  int width = 0, height = 0;
  std::vector<glm::vec3> pixels;
  const glm::vec3& at(int x, int y) const {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
};

struct Camera {
  glm::vec3 position{0, 0, 5}, look_at{0}, up{0, 1, 0};
  float fov_degrees = 40;    // vertical
  float aperture = 0;        // radius of the lens; 0: a pinhole
  float focus_distance = 0;  // of the plane that is sharp, along the view; 0: through look_at
};

// Colour of a material: a constant, an image looked up by the mesh's UV, or a solid texture.
struct ImageColor {
  std::size_t image = 0;
};
struct SolidColor {
  std::size_t texture = 0;
  bool world_space = false;
  glm::dmat4 to_texels{1};  // from object (or world) space to the texture's texels
};
using Color = std::variant<glm::vec3, ImageColor, SolidColor>;

// A share from 0 to 1: a constant, a channel of an image (0: red), or one of the solid texture that
// the material has.
struct ImageChannel {
  std::size_t image = 0;
  int channel = 0;
};
struct SolidChannel {
  std::size_t channel = 0;
};
using Input = std::variant<float, ImageChannel, SolidChannel>;

enum class MaterialType { diffuse, coated, principled, dielectric };

// The surface lies higher along its normal by `depth` (of the scene's units) times a channel of the
// material's solid texture; only its normal changes.
struct Bump {
  std::size_t channel = 0;
  float depth = 0;
};

struct Material {
  std::string name;
  MaterialType type = MaterialType::diffuse;
  Color color = glm::vec3(0.5f);
  std::optional<SolidColor> channels_of;  // the solid texture, where the color is none
  Input roughness = 0.2f;  // GGX alpha is its square; of the coat of a coated material
  float ior = 1.5f;        // of the coat of a coated material
  Input metallic = 0.0f, specular = 1.0f, coat = 0.0f, coat_roughness = 0.05f;  // principled
  std::optional<Bump> bump;
  glm::vec3 emission{0};  // radiance; found by chance only, never sampled as a light
};

inline constexpr Input Material::*kInputs[] = {&Material::roughness, &Material::metallic,
                                               &Material::specular, &Material::coat,
                                               &Material::coat_roughness};

struct Object {
  std::size_t mesh = 0, material = 0;
  glm::mat4 to_world{1};
};

// Emits `radiance` from the side that edge_u x edge_v points to; the other side is black.
struct RectangleLight {
  glm::vec3 corner{0}, edge_u{1, 0, 0}, edge_v{0, 1, 0};
  glm::vec3 radiance{1};
};

// Emits outward only.
struct SphereLight {
  glm::vec3 center{0};
  float radius = 1;
  glm::vec3 radiance{1};
};

// Emits from the side that its faces look to; in the scene's coordinates.
struct MeshLight {
  Mesh mesh;
  glm::vec3 radiance{1};
};

// Light from infinitely far away; a constant colour is an image of one pixel.
struct EnvironmentImage {
  ColorImage image;
  float rotation_degrees = 0;  // about the y axis
};

struct Scene {
  Camera camera;
  RenderSettings settings;
  Display display;
  std::vector<Mesh> meshes;
  std::vector<ColorImage> images;
  std::vector<solidtex::texture> textures;
  std::vector<Material> materials;
  std::vector<Object> objects;
  std::vector<RectangleLight> lights;
  std::vector<SphereLight> sphere_lights;
  std::vector<MeshLight> mesh_lights;
  std::optional<EnvironmentImage> environment;
  std::string source;              // the text it was read from
  std::vector<std::string> notes;  // what loading found worth saying, one line each
};

}  // namespace solidtex::pathtracer
