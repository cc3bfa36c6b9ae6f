// Bytes of small model files, encoded independently of the reader.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace solidtex::engine {

struct ModelBytes {
  nlohmann::json document;
  nlohmann::json header = {};
  std::vector<float> values = {};

  // Appends a tensor with the values first, first + 0.01, ...
  void add(const std::string& name, const std::vector<std::int64_t>& shape, float first = 0) {
    const std::size_t begin = values.size() * sizeof(float);
    std::int64_t count = 1;
    for (const std::int64_t size : shape) count *= size;
    for (std::int64_t i = 0; i < count; ++i)
      values.push_back(first + 0.01f * static_cast<float>(i));
    header[name] = {{"dtype", "F32"},
                    {"shape", shape},
                    {"data_offsets", {begin, values.size() * sizeof(float)}}};
  }

  std::vector<std::byte> encode() const {
    nlohmann::json complete = header;
    complete["__metadata__"] = {{"solidtex", document.dump()}};
    const std::string text = complete.dump();
    std::vector<std::byte> bytes(8 + text.size() + values.size() * sizeof(float));
    const std::uint64_t size = text.size();
    std::memcpy(bytes.data(), &size, 8);
    std::memcpy(bytes.data() + 8, text.data(), text.size());
    std::memcpy(bytes.data() + 8 + text.size(), values.data(), values.size() * sizeof(float));
    return bytes;
  }
};

inline nlohmann::json document_of(const std::string& family, const nlohmann::json& architecture,
                                  const std::vector<std::string>& channels) {
  return {{"version", 1},         {"name", "tiny"},        {"family", family},
          {"channels", channels}, {"color_space", "srgb"}, {"noise", {{"scheme", "solidtex-1"}}},
          {family, architecture}};
}

// Coarse noise, upsampled and concatenated with fine noise, then a 3^3 convolution to two channels.
inline ModelBytes lattice_bytes() {
  const nlohmann::json nodes = nlohmann::json::parse(R"([
      {"name": "coarse", "op": "noise", "level": 1, "channels": 1, "distribution": "uniform"},
      {"name": "fine", "op": "noise", "level": 0, "channels": 2, "distribution": "normal"},
      {"name": "up", "op": "upsample", "inputs": ["coarse"]},
      {"name": "joined", "op": "concat", "inputs": ["up", "fine"]},
      {"name": "conv", "op": "conv3d", "inputs": ["joined"], "out_channels": 2, "kernel": 3}])");
  ModelBytes bytes{
      document_of("field", {{"nodes", nodes}, {"output", "conv"}}, {"albedo.r", "roughness"})};
  bytes.add("conv.weight", {2, 3, 3, 3, 3});
  bytes.add("conv.bias", {2}, 0.5f);
  return bytes;
}

inline ModelBytes sampler_bytes() {
  const nlohmann::json sizes = {
      {"octaves", 4}, {"hidden_layers", 3}, {"width", 5}, {"slope", 0.25}};
  ModelBytes bytes{document_of("sampler", sizes, {"albedo.r"})};
  bytes.add("transforms", {4, 3, 3}, 1);
  bytes.add("constant", {5}, 2);
  for (const std::string layer : {"0", "1", "2"}) {
    bytes.add("hidden." + layer + ".weight", {5, 5});
    bytes.add("hidden." + layer + ".bias", {5});
    if (layer != "2") bytes.add("hidden." + layer + ".noise", {5, 2}, 3);
  }
  bytes.add("output.weight", {1, 5});
  bytes.add("output.bias", {1});
  return bytes;
}

}  // namespace solidtex::engine
