#include "plugins/pathtracer/integrator/checkpoint.h"

#include <fstream>
#include <solidtex/solidtex.hpp>
#include <stdexcept>

#include "plugins/mesh/fingerprint.h"
#include "plugins/pathtracer/film/output_stream.h"
#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {
namespace {

using nlohmann::json;

constexpr const char* kKind = "solidtex-checkpoint 1";

// Hashes the scene file and all files it refers to.
std::uint64_t fingerprint_of(const Scene& scene) {
  Fingerprint result;
  result.add(scene.source);
  for (const Mesh& mesh : scene.meshes) add(result, mesh);
  for (const MeshLight& light : scene.mesh_lights) add(result, light.mesh);
  for (const ColorImage& image : scene.images) result.add(image.pixels);
  if (scene.environment) result.add(scene.environment->image.pixels);
  for (const solidtex::texture& texture : scene.textures) {
    if (texture.path().empty()) {  // made from a code of a texture space, which its document has
      result.add(texture.metadata_json());
    } else {
      result.add_content_of(texture.path());
    }
  }
  return result.value();
}

json names_of(const AovSet& aovs) {
  json names = json::array();
  for (const AovInfo& aov : all_aovs()) {
    if (aovs.has(aov.aov)) names.push_back(aov.name);
  }
  return names;
}

json to_json(const RenderStatistics& statistics) {
  return {statistics.ray_count, statistics.texture_point_count, statistics.invalid_sample_count};
}

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& found,
                         const std::string& expected) {
  throw std::runtime_error(file.string() + ": found " + found + ", expected " + expected);
}

void check_identity(const std::filesystem::path& file, const json& found, const json& expected) {
  for (const auto& [key, value] : expected.items()) {
    const json other = found.value(key, json());
    if (other == value) continue;
    if (key == "scene")
      refuse(file, "a checkpoint of another scene, or of this one before it was changed",
             "a checkpoint of this scene");
    refuse(file, "a checkpoint with the " + key + " " + other.dump(), value.dump());
  }
}

}  // namespace

json identity_of(const Scene& scene, const RenderSettings& settings) {
  return {{"version", solidtex::version()},
          {"scene", fingerprint_of(scene)},
          {"size", {settings.width, settings.height}},
          {"crop", {settings.crop.x0, settings.crop.y0, settings.crop.x1, settings.crop.y1}},
          {"samples", settings.samples},
          {"seed", settings.seed},
          {"max_depth", settings.max_depth},
          {"light_sampling", static_cast<int>(settings.light_sampling)},
          {"texture_filter", static_cast<int>(settings.texture_filter)},
          {"layers", names_of(settings.aovs)},
          {"noise", settings.noise}};
}

void write_checkpoint(const std::filesystem::path& file, const json& identity,
                      const RenderStatistics& statistics, Framebuffer& framebuffer) {
  std::ofstream stream(file, std::ios::binary);
  stream << kKind << '\n'
         << json{{"identity", identity}, {"statistics", to_json(statistics)}}.dump() << '\n';
  for (const std::span<const std::byte> bytes : framebuffer.arrays()) {
    stream.write(reinterpret_cast<const char*>(bytes.data()),
                 static_cast<std::streamsize>(bytes.size()));
  }
  close_or_throw(stream, file);
}

RenderStatistics read_checkpoint(const std::filesystem::path& file, const json& identity,
                                 Framebuffer& framebuffer) {
  std::ifstream stream(file, std::ios::binary);
  std::string kind, header;
  if (!std::getline(stream, kind) || kind != kKind || !std::getline(stream, header)) {
    refuse(file, "another file", "a checkpoint of solidtex-render");
  }
  const json document = json::parse(header, nullptr, false);
  if (!document.is_object() || !document.contains("identity") || !document.contains("statistics")) {
    refuse(file, "a damaged header", "a checkpoint of solidtex-render");
  }
  check_identity(file, document["identity"], identity);

  Framebuffer read = framebuffer;
  for (const std::span<std::byte> bytes : read.arrays()) {
    stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  if (!stream || stream.peek() != std::ifstream::traits_type::eof()) {
    refuse(file, "a file of another length", "a complete checkpoint");
  }
  framebuffer = std::move(read);
  const json& counts = document["statistics"];
  RenderStatistics statistics;
  statistics.ray_count = counts[0];
  statistics.texture_point_count = counts[1];
  statistics.invalid_sample_count = counts[2];
  return statistics;
}

}  // namespace solidtex::pathtracer
