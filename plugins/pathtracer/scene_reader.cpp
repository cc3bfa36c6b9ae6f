// From a scene file to a Scene: parse, check against the schema, load what it refers to.
#include <cmath>
#include <fstream>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <tuple>

#include "plugins/pathtracer/image_io.h"
#include "plugins/pathtracer/mesh_cut.h"
#include "plugins/pathtracer/scene.h"
#include "plugins/pathtracer/scene_transform.h"
#include "plugins/pathtracer/schema.h"
#include "plugins/pathtracer/textures.h"

namespace solidtex::pathtracer {
namespace {

using nlohmann::json;
using Pointer = json::json_pointer;

constexpr int kMaxDepth = 32;  // far more than the schema allows, far less than the stack does

json parse_file(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream || std::filesystem::is_directory(file)) {
    throw SceneError(file.string() + ": found no readable file, expected a scene");
  }
  // nlohmann-json keeps the last of two equal keys; a scene must not lose the first one silently.
  std::vector<std::set<std::string>> open_objects;
  const auto check_structure = [&](int depth, json::parse_event_t event, json& value) {
    if (depth > kMaxDepth) {
      throw SceneError(file.string() + ": found more than " + std::to_string(kMaxDepth) +
                       " nested values, expected a scene");
    }
    if (event == json::parse_event_t::object_start) open_objects.emplace_back();
    if (event == json::parse_event_t::object_end) open_objects.pop_back();
    if (event == json::parse_event_t::key && !open_objects.back().insert(value).second) {
      throw SceneError(file.string() + ": found the key " + value.dump() +
                       " twice in one object, expected it once");
    }
    return true;
  };
  try {
    return json::parse(stream, check_structure);
  } catch (const json::exception& error) {
    throw SceneError(file.string() + ": found what is not JSON (" + error.what() +
                     "), expected a scene");
  }
}

TextureFilter texture_filter(const std::string& name) {
  if (name == "stochastic") return TextureFilter::stochastic;
  return name == "none" ? TextureFilter::none : TextureFilter::footprint;
}

class SceneReader {
 public:
  explicit SceneReader(const std::filesystem::path& file)
      : file_(file), document_(parse_file(file)) {
    check_scene_schema(document_, file_.string());
  }

  Scene read() {
    read_settings();
    read_camera();
    read_materials();
    read_objects();
    read_environment();
    read_lights();
    if (scene_.objects.empty() && scene_.lights.empty() && !scene_.environment) {
      refuse(Pointer(), "nothing to see", "objects, lights or an environment");
    }
    return std::move(scene_);
  }

 private:
  [[noreturn]] void refuse(const Pointer& place, const std::string& found,
                           const std::string& expected) const {
    refuse_json(file_.string(), place, found, expected);
  }

  const json& at(const Pointer& place) const { return document_.at(place); }

  // Loading errors name the file they are about; this adds who asked for it.
  template <class Load>
  auto load(const Pointer& place, Load load_file) const {
    try {
      return load_file();
    } catch (const std::exception& error) {
      throw SceneError(file_.string() + ": " + place.to_string() + ": " + error.what());
    }
  }

  std::filesystem::path beside_scene(const Pointer& place) const {
    return file_.parent_path() / at(place).get<std::string>();
  }

  void read_settings() {
    const json render = document_.value("render", json::object());
    RenderSettings& settings = scene_.settings;
    if (render.contains("size")) {
      settings.width = render["size"][0];
      settings.height = render["size"][1];
    }
    settings.samples = render.value("spp", settings.samples);
    settings.seed = render.value("seed", settings.seed);
    settings.max_depth = render.value("max_depth", settings.max_depth);
    settings.texture_filter = texture_filter(render.value("texture_filter", "footprint"));
    scene_.exposure = render.value("exposure", 0.0f);
  }

  void read_camera() {
    const json& camera = document_["camera"];
    Camera& result = scene_.camera;
    result.position = to_vec3(camera["position"]);
    result.look_at = to_vec3(camera["look_at"]);
    if (camera.contains("up")) result.up = to_vec3(camera["up"]);
    result.fov_degrees = camera["fov"];
    const glm::vec3 forward = result.look_at - result.position;
    if (glm::length(forward) == 0) {
      refuse("/camera/look_at"_json_pointer, quote_json(camera["look_at"]),
             "a point that is not the camera's position");
    }
    if (glm::length(glm::cross(forward, result.up)) <=
        1e-6f * glm::length(forward) * glm::length(result.up)) {
      const Pointer place("/camera");
      refuse(
          camera.contains("up") ? place / "up" : place,
          "the up direction " + quote_json(camera.value("up", json{0, 1, 0})) + " along the view",
          "another direction");
    }
  }

  void read_materials() {
    for (const auto& [name, value] : document_["materials"].items()) {
      const Pointer place = Pointer("/materials") / name;
      Material material;
      material.name = name;
      material.type = value["type"] == "coated" ? MaterialType::coated : MaterialType::diffuse;
      for (const char* key : {"roughness", "ior"}) {
        if (material.type != MaterialType::coated && value.contains(key)) {
          refuse(place / key, "a key that goes with \"type\": \"coated\"",
                 "a coated material, or no such key");
        }
      }
      material.ior = value.value("ior", material.ior);
      if (value.contains("emission")) material.emission = to_vec3(value["emission"]);
      material.color = read_color(place / "color");
      if (value.contains("roughness")) read_roughness(place / "roughness", material);
      scene_.materials.push_back(std::move(material));
    }
  }

  // A number, or a channel of the solid texture that the material's color comes from.
  void read_roughness(const Pointer& place, Material& material) {
    const json& roughness = at(place);
    if (roughness.is_number()) {
      material.roughness = roughness;
      return;
    }
    const auto* solid = std::get_if<SolidColor>(&material.color);
    if (!solid) {
      refuse(place, "a channel for a color that is no solid texture",
             "a number, or a color with \"solid\"");
    }
    material.roughness_channel = roughness["channel"];
    load(place / "channel", [&] {
      return channel_index(scene_.textures[solid->texture], material.roughness_channel);
    });
  }

  Color read_color(const Pointer& place) {
    const json& color = at(place);
    if (color.is_array()) return to_vec3(color);
    if (color.contains("image")) return ImageColor{load_image(place)};
    SolidColor result;
    result.texture = load_texture(place);
    result.world_space = color.value("space", "object") == "world";
    result.to_texels = color.contains("transform")
                           ? read_transform(document_, place / "transform", file_.string())
                           : glm::dmat4(1);
    const glm::dvec3 texels = to_scale(color.value("texels_per_unit", json(1.0)));
    result.to_texels = glm::scale(glm::dmat4(1), texels) * result.to_texels;
    return result;
  }

  std::size_t load_image(const Pointer& place) {
    const std::string space = at(place).value("color_space", "");
    const ImageEncoding encoding = space == "srgb"     ? ImageEncoding::srgb
                                   : space == "linear" ? ImageEncoding::linear
                                                       : ImageEncoding::automatic;
    const std::filesystem::path file = beside_scene(place / "image");
    scene_.images.push_back(load(place / "image", [&] { return read_image(file, encoding); }));
    return scene_.images.size() - 1;
  }

  // As in the engine, a slash or the ending .solidtex makes it a path, else it is a shipped model.
  std::string model_of(const Pointer& place) const {
    const std::string name = at(place).get<std::string>();
    const bool is_path = name.find('/') != std::string::npos || name.ends_with(".solidtex");
    return is_path ? beside_scene(place).string() : name;
  }

  std::size_t load_texture(const Pointer& place) {
    const json& color = at(place);
    const std::string model = model_of(place / "solid");
    const std::uint64_t seed = color.value("seed", std::uint64_t{0});
    const auto precision = color.value("precision", "full") == "fast" ? SOLIDTEX_PRECISION_FAST
                                                                      : SOLIDTEX_PRECISION_FULL;
    const auto key = std::make_tuple(model, seed, precision);
    if (const auto known = textures_.find(key); known != textures_.end()) return known->second;
    scene_.textures.push_back(load(place / "solid", [&] {
      solidtex::texture texture(model, {.seed = seed, .precision = precision});
      albedo_channels(texture);
      return texture;
    }));
    return textures_[key] = scene_.textures.size() - 1;
  }

  void read_objects() {
    for (std::size_t i = 0; i < document_["objects"].size(); ++i) {
      const Pointer place = Pointer("/objects") / i;
      Object object;
      object.mesh = find_mesh(place);
      object.material = find_material(place / "material");
      if (at(place).contains("transform")) {
        object.to_world = glm::mat4(read_transform(document_, place / "transform", file_.string()));
      }
      const Color& color = scene_.materials[object.material].color;
      if (std::holds_alternative<ImageColor>(color) && scene_.meshes[object.mesh].uvs.empty()) {
        refuse(place / "mesh", "a mesh without texture coordinates",
               "some, because the material \"" + scene_.materials[object.material].name +
                   "\" has an image");
      }
      scene_.objects.push_back(object);
    }
  }

  // A file that several objects name, cut in the same way, is loaded once and instanced.
  std::size_t find_mesh(const Pointer& place) {
    const std::string key = at(place / "mesh").dump() + at(place).value("cuts", json()).dump();
    if (const auto known = meshes_.find(key); known != meshes_.end()) return known->second;
    Mesh mesh = read_mesh(place / "mesh");
    if (at(place).contains("cuts")) mesh = cut(place / "cuts", mesh);
    scene_.meshes.push_back(std::move(mesh));
    return meshes_[key] = scene_.meshes.size() - 1;
  }

  Mesh read_mesh(const Pointer& place) {
    return load(place, [&] {
      Mesh mesh = load_mesh(beside_scene(place));
      const MeshReport report = repair_mesh(mesh);
      if (mesh.triangles.empty()) {
        throw SceneError(mesh.file + ": found only degenerate triangles, expected a surface");
      }
      scene_.notes.push_back(describe(mesh, report));
      return mesh;
    });
  }

  Mesh cut(const Pointer& place, const Mesh& mesh) {
    std::vector<Cut> cuts;
    for (std::size_t i = 0; i < at(place).size(); ++i) cuts.push_back(read_cut(place / i, mesh));
    return load(place, [&] { return cut_mesh(mesh, cuts); });
  }

  Cut read_cut(const Pointer& place, const Mesh& mesh) {
    Cut cut;
    if (at(place).contains("clip")) {
      const json& plane = at(place)["clip"];
      if (to_vec3(plane["normal"]) == glm::vec3(0)) {
        refuse(place / "clip" / "normal", quote_json(plane["normal"]), "a direction");
      }
      cut.tool = make_half_space(to_vec3(plane["point"]), to_vec3(plane["normal"]), mesh);
      return cut;
    }
    const bool subtract = at(place).contains("subtract");
    cut.operation = subtract ? Cut::Operation::subtract : Cut::Operation::intersect;
    const Pointer shape = place / (subtract ? "subtract" : "intersect");
    cut.tool = read_tool(shape);
    if (at(shape).contains("transform")) {
      transform_mesh(cut.tool, read_transform(document_, shape / "transform", file_.string()));
    }
    return cut;
  }

  Mesh read_tool(const Pointer& place) {
    const json& shape = at(place);
    if (shape.contains("box")) return make_box(glm::vec3(to_scale(shape["box"])));
    if (shape.contains("sphere")) return make_sphere(shape["sphere"]);
    return read_mesh(place / "mesh");
  }

  std::size_t find_material(const Pointer& place) const {
    const std::string name = at(place).get<std::string>();
    std::string names;
    for (std::size_t i = 0; i < scene_.materials.size(); ++i) {
      if (scene_.materials[i].name == name) return i;
      names += (names.empty() ? "" : ", ") + scene_.materials[i].name;
    }
    refuse(place, quote_json(name), "the name of a material (" + names + ")");
  }

  void read_environment() {
    if (!document_.contains("environment")) return;
    const Pointer place("/environment");
    const json& environment = at(place);
    EnvironmentImage result;
    if (environment.contains("file")) {
      result.image = load(place / "file", [&] {
        return read_image(beside_scene(place / "file"), ImageEncoding::automatic);
      });
    } else {
      result.image = {"", 1, 1, {to_vec3(environment["color"])}};
    }
    result.rotation_degrees = environment.value("rotation", 0.0f);
    const float scale = environment.value("scale", 1.0f);
    float brightest = 0;
    for (glm::vec3& pixel : result.image.pixels) {
      pixel *= scale;
      brightest = std::max({brightest, pixel.x, pixel.y, pixel.z});
    }
    if (!(brightest > 0) || !std::isfinite(brightest)) {
      refuse(place, brightest > 0 ? "infinite light" : "no light at all",
             "an environment that shines, or none");
    }
    scene_.environment = std::move(result);
  }

  void read_lights() {
    const json lights = document_.value("lights", json::array());
    for (std::size_t i = 0; i < lights.size(); ++i) {
      const Pointer place = Pointer("/lights") / i;
      const json& light = lights[i];
      const glm::vec3 position = to_vec3(light["position"]);
      const glm::vec3 direction = to_vec3(light["look_at"]) - position;
      if (glm::length(direction) == 0) {
        refuse(place / "look_at", quote_json(light["look_at"]),
               "a point that is not the light's position");
      }
      if (to_vec3(light["radiance"]) == glm::vec3(0)) {
        refuse(place / "radiance", quote_json(light["radiance"]), "a light that shines");
      }
      scene_.lights.push_back(make_rectangle(position, glm::normalize(direction), light["size"][0],
                                             light["size"][1], to_vec3(light["radiance"])));
    }
  }

  // Width is horizontal; a light that looks straight up or down has its width along x.
  static RectangleLight make_rectangle(const glm::vec3& center, const glm::vec3& direction,
                                       float width, float height, const glm::vec3& radiance) {
    const glm::vec3 horizontal = glm::cross(glm::vec3(0, 1, 0), direction);
    const glm::vec3 u =
        glm::length(horizontal) > 1e-4f ? glm::normalize(horizontal) : glm::vec3(1, 0, 0);
    const glm::vec3 v = glm::cross(direction, u);
    RectangleLight light{center - 0.5f * (width * u + height * v), width * u, height * v, radiance};
    return light;
  }

  std::filesystem::path file_;
  json document_;
  Scene scene_;
  std::map<std::string, std::size_t> meshes_;
  std::map<std::tuple<std::string, std::uint64_t, solidtex_precision>, std::size_t> textures_;
};

}  // namespace

std::shared_ptr<const Scene> load_scene(const std::filesystem::path& file) {
  return std::make_shared<const Scene>(SceneReader(file).read());
}

RenderSettings settings_of(const Scene& scene) { return scene.settings; }
float exposure_of(const Scene& scene) { return scene.exposure; }
std::vector<std::string> notes_of(const Scene& scene) { return scene.notes; }

}  // namespace solidtex::pathtracer
