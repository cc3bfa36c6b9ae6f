#include "tools/bake/glb.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "tools/bake/image_file.h"
#include "tools/common/output_file.h"

namespace solidtex::tools {
namespace {

static_assert(std::endian::native == std::endian::little, "glTF is little-endian");

using Json = nlohmann::ordered_json;

constexpr int kFloat = 5126, kUnsignedInt = 5125, kVertices = 34962, kIndices = 34963;

// The JSON document and the binary chunk of one mesh.
class Document {
 public:
  Document(const std::filesystem::path& path, const mesh::Mesh& mesh, const MapSet& maps)
      : path_(path), maps_(maps) {
    json_ = {{"asset", {{"version", "2.0"}, {"generator", "solidtex-bake"}}},
             {"scene", 0},
             {"scenes", Json::array({{{"nodes", Json::array({0})}}})},
             {"nodes", Json::array({{{"mesh", 0}}})}};
    if (mesh.origin != glm::dvec3(0)) {
      json_["nodes"][0]["translation"] = {mesh.origin.x, mesh.origin.y, mesh.origin.z};
    }
    add_mesh(mesh);
    add_material();
    json_["buffers"] = Json::array({{{"byteLength", bytes_.size()}}});
  }

  void write() const {
    std::string text = json_.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const std::size_t size = 12 + 8 + text.size() + 8 + bytes_.size();
    if (size > std::numeric_limits<std::uint32_t>::max()) {
      throw WriteError(path_, "a .glb holds 4 GiB at most, --size makes it less");
    }
    OutputFile file(path_);
    std::uint64_t at = 0;
    const auto append = [&](const void* data, std::size_t count) {
      file.write(at, data, count);
      at += count;
    };
    const auto word = [&](std::size_t value) {
      const auto number = static_cast<std::uint32_t>(value);
      append(&number, sizeof number);
    };
    append("glTF", 4);
    word(2);
    word(size);
    word(text.size());
    append("JSON", 4);
    append(text.data(), text.size());
    word(bytes_.size());
    append("BIN", 4);  // with the zero at its end
    append(bytes_.data(), bytes_.size());
    file.close();
  }

 private:
  std::size_t add_view(std::span<const std::byte> bytes, int target) {
    Json view = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes.size()}};
    if (target != 0) view["target"] = target;
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    json_["bufferViews"].push_back(std::move(view));
    return json_["bufferViews"].size() - 1;
  }

  template <class Value>
  std::size_t add_accessor(const std::vector<Value>& values, const char* type, int component,
                           std::size_t count) {
    const int target = component == kFloat ? kVertices : kIndices;
    const std::size_t view = add_view(std::as_bytes(std::span(values)), target);
    json_["accessors"].push_back(
        {{"bufferView", view}, {"componentType", component}, {"count", count}, {"type", type}});
    return json_["accessors"].size() - 1;
  }

  void add_mesh(const mesh::Mesh& mesh) {
    const std::size_t count = mesh.positions.size();
    Json attributes = {{"POSITION", add_accessor(mesh.positions, "VEC3", kFloat, count)}};
    glm::vec3 low = mesh.positions.front(), high = low;
    for (const glm::vec3& p : mesh.positions) {
      low = glm::min(low, p);
      high = glm::max(high, p);
    }
    json_["accessors"][0]["min"] = {low.x, low.y, low.z};
    json_["accessors"][0]["max"] = {high.x, high.y, high.z};
    if (!mesh.normals.empty()) {
      attributes["NORMAL"] = add_accessor(mesh.normals, "VEC3", kFloat, count);
    }
    std::vector<glm::vec2> uvs = mesh.uvs;  // glTF's begin at the top left
    for (glm::vec2& uv : uvs) uv.y = 1 - uv.y;
    attributes["TEXCOORD_0"] = add_accessor(uvs, "VEC2", kFloat, count);
    const std::size_t indices =
        add_accessor(mesh.triangles, "SCALAR", kUnsignedInt, 3 * mesh.triangles.size());
    const Json primitive = {{"attributes", attributes}, {"indices", indices}, {"material", 0}};
    json_["meshes"] = Json::array({{{"primitives", Json::array({primitive})}}});
  }

  // An image with components from 0 to 1; returns its texture.
  Json add_texture(const std::string& name, int components, Encoding colors,
                   const std::vector<float>& values) {
    std::vector<std::uint8_t> pixels(values.size());
    std::ranges::transform(values, pixels.begin(), quantize<std::uint8_t>);
    const std::vector<unsigned char> png =
        encode_png(path_, {maps_.size(), maps_.size(), components, false, colors},
                   std::as_bytes(std::span(pixels)));
    const std::size_t view = add_view(std::as_bytes(std::span(png)), 0);
    json_["images"].push_back({{"name", name}, {"mimeType", "image/png"}, {"bufferView", view}});
    const std::size_t source = json_["images"].size() - 1;
    json_["textures"].push_back({{"source", source}});
    return {{"index", json_["textures"].size() - 1}};
  }

  // Roughness in green and metallic in blue.
  std::vector<float> surface_values(const MapSet::Map* roughness,
                                    const MapSet::Map* metallic) const {
    const auto texels =
        static_cast<std::size_t>(maps_.size()) * static_cast<std::size_t>(maps_.size());
    std::vector<float> values(3 * texels, 1.0f);
    for (std::size_t i = 0; i < texels; ++i) {
      if (roughness) values[3 * i + 1] = roughness->values[i];
      if (metallic) values[3 * i + 2] = metallic->values[i];
    }
    return values;
  }

  void add_material() {
    const MapSet::Map* roughness = maps_.find("roughness");
    const MapSet::Map* metallic = maps_.find("metallic");
    Json surface = {{"metallicFactor", metallic ? 1 : 0},
                    {"roughnessFactor", roughness ? 1.0 : 0.5}};
    Json material = {{"name", "solidtex"}};
    if (const MapSet::Map* albedo = maps_.find("albedo")) {
      std::vector<float> values = albedo->values;
      for (float& value : values) value = display_value(value, albedo->encoding);
      surface["baseColorTexture"] =
          add_texture("BaseColor", static_cast<int>(albedo->components()), Encoding::srgb, values);
    }
    if (roughness || metallic) {
      surface["metallicRoughnessTexture"] =
          add_texture("MetallicRoughness", 3, Encoding::data, surface_values(roughness, metallic));
    }
    material["pbrMetallicRoughness"] = surface;
    if (const MapSet::Map* normal = maps_.find("normal")) {
      std::vector<float> values = normal->values;
      for (float& value : values) value = 0.5f + 0.5f * value;
      material["normalTexture"] = add_texture("Normal", 3, Encoding::data, values);
    }
    json_["materials"] = Json::array({material});
  }

  const std::filesystem::path path_;
  const MapSet& maps_;
  Json json_;
  std::vector<std::byte> bytes_;
};

}  // namespace

void write_glb(const std::filesystem::path& path, const mesh::Mesh& mesh, const MapSet& maps) {
  Document(path, mesh, maps).write();
}

}  // namespace solidtex::tools
