// A scene as plain data: loaded, checked, in linear light.
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

// Linear colors. Row 0 is the top.
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
  float aperture = 0;        // lens radius; 0: pinhole
  float focus_distance = 0;  // of the focal plane, along the view; 0: distance of look_at
};

// Channel of an image (0: red) mapped by the mesh's UVs.
struct ImageChannel {
  std::size_t image = 0;
  int channel = 0;
};

// Attribute of the mesh's vertices.
struct VertexAttribute {
  std::string name;
};

// Distance from a shape's surface, negative inside; from a plane, negative behind it.
struct ShapeDistance {
  enum class Shape { plane, sphere, box };
  Shape shape = Shape::plane;
  glm::dvec3 size{1};      // half edges of a box, radius of a sphere; a plane is z = 0
  glm::dmat4 to_shape{1};  // from object (or world) space
};

// Blend of solid textures along a walk. A number that varies over the surface says where on it a
// point lies.
struct Mix {
  std::vector<std::size_t> textures;  // at equal steps; a point gets the two nearest ones
  std::variant<VertexAttribute, ImageChannel, ShapeDistance> by;
  glm::dvec2 range{0, 1};  // numbers at the first and the last texture
  // Mean albedos of independent textures, to keep their contrast; empty for textures that resemble
  // their neighbors point by point.
  std::vector<glm::vec3> means;
};

// Color of a material: a constant, an image mapped by the mesh's UVs, or a solid texture.
struct ImageColor {
  std::size_t image = 0;
};
struct SolidColor {
  std::size_t texture = 0;
  bool world_space = false;
  glm::dmat4 to_texels{1};  // from object (or world) space to texels
  // The scene file states no scale: the reader scales a copy of the material to each object.
  bool fits_object = false;
  std::optional<Mix> mix{};  // blends several textures; `texture` is the first
};
using Color = std::variant<glm::vec3, ImageColor, SolidColor>;

// A number from 0 to 1: a constant, a channel of an image, or a channel of the material's solid
// texture.
struct SolidChannel {
  std::size_t channel = 0;
};
using Input = std::variant<float, ImageChannel, SolidChannel>;

enum class MaterialType { diffuse, coated, principled, dielectric };

// Bump map: the height along the normal is `depth` (in world units) times a channel of the
// material's solid texture. Changes the shading normal only.
struct Bump {
  std::size_t channel = 0;
  float depth = 0;
};

struct Material {
  std::string name;
  MaterialType type = MaterialType::diffuse;
  Color color = glm::vec3(0.5f);
  std::optional<SolidColor> channels_of;  // solid texture of the channels, if the color has none
  Input roughness = 0.2f;                 // square root of GGX alpha; of a coated material's coat
  float ior = 1.5f;                       // of a coated material's coat
  Input metallic = 0.0f, specular = 1.0f, coat = 0.0f, coat_roughness = 0.05f;  // principled
  std::optional<Bump> bump;
  glm::vec3 emission{0};  // radiance; not sampled as a light
};

inline constexpr Input Material::*kInputs[] = {&Material::roughness, &Material::metallic,
                                               &Material::specular, &Material::coat,
                                               &Material::coat_roughness};

struct Object {
  std::size_t mesh = 0, material = 0;
  glm::mat4 to_world{1};  // from the mesh's positions to render space
  mesh::Box box{};        // of the mesh file, before cuts
};

// Emits on the side that edge_u x edge_v points to.
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

// Emits on the front of its faces. Vertices are in render space.
struct MeshLight {
  Mesh mesh;
  glm::vec3 radiance{1};
};

// Latitude-longitude image of infinitely distant light. A constant color is an image of one pixel.
struct EnvironmentImage {
  ColorImage image;
  float rotation_degrees = 0;  // about the y axis
};

// All positions are in render space: world space relative to `origin`. The origin is zero unless
// the camera is so far away from zero that single precision would lose detail.
struct Scene {
  glm::dvec3 origin{0};
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
  std::string source;              // text of the scene file
  std::vector<std::string> notes;  // messages of loading, one line each
};

}  // namespace solidtex::pathtracer
