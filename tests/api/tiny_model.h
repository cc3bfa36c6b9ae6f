// Valid model files in memory: these tests need only the public library.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

struct TinyTensor {
  std::string name, shape;  // shape as JSON, e.g. "[2, 3]"
  std::size_t count;
};

inline std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) result += (c == '"' ? std::string("\\\"") : std::string(1, c));
  return result;
}

// A safetensors file whose tensors hold small, varied values.
inline std::vector<std::byte> tiny_file(const std::string& document,
                                        const std::vector<TinyTensor>& tensors) {
  std::string header = R"({"__metadata__":{"solidtex":")" + escaped(document) + "\"}";
  std::vector<float> data;
  for (const TinyTensor& tensor : tensors) {
    const std::size_t begin = data.size() * sizeof(float);
    for (std::size_t i = 0; i < tensor.count; ++i) {
      data.push_back(static_cast<float>((i * 7 + data.size()) % 13) * 0.04f - 0.2f);
    }
    header += ",\"" + tensor.name + R"(":{"dtype":"F32","shape":)" + tensor.shape +
              R"(,"data_offsets":[)" + std::to_string(begin) + "," +
              std::to_string(data.size() * sizeof(float)) + "]}";
  }
  header += "}";
  header.resize((header.size() + 7) / 8 * 8, ' ');

  std::vector<std::byte> bytes(8 + header.size() + data.size() * sizeof(float));
  for (int i = 0; i < 8; ++i) bytes[i] = static_cast<std::byte>(header.size() >> (8 * i) & 0xFF);
  std::memcpy(bytes.data() + 8, header.data(), header.size());
  std::memcpy(bytes.data() + 8 + header.size(), data.data(), data.size() * sizeof(float));
  return bytes;
}

inline std::vector<std::byte> tiny_lattice_file() {
  return tiny_file(
      R"({"version":1,"name":"tiny-lattice","family":"field","channels":["albedo.r","rough"],)"
      R"("color_space":"srgb","noise":{"scheme":"solidtex-1"},"field":{"output":"out","nodes":[)"
      R"({"name":"coarse","op":"noise","level":1,"channels":1,"distribution":"uniform"},)"
      R"({"name":"up","op":"upsample","inputs":["coarse"]},)"
      R"({"name":"fine","op":"noise","level":0,"channels":2,"distribution":"normal"},)"
      R"({"name":"both","op":"concat","inputs":["up","fine"]},)"
      R"({"name":"out","op":"conv3d","out_channels":2,"kernel":3,"inputs":["both"]}]}})",
      {{"out.bias", "[2]", 2}, {"out.weight", "[2,3,3,3,3]", 162}});
}

inline std::vector<std::byte> tiny_sampler_file() {
  return tiny_file(
      R"({"version":1,"name":"tiny-sampler","family":"sampler","channels":["r","g","b"],)"
      R"("color_space":"linear","noise":{"scheme":"solidtex-1"},)"
      R"("sampler":{"octaves":2,"hidden_layers":3,"width":4,"slope":0.2}})",
      {{"constant", "[4]", 4},
       {"hidden.0.bias", "[4]", 4},
       {"hidden.0.noise", "[4,1]", 4},
       {"hidden.0.weight", "[4,4]", 16},
       {"hidden.1.bias", "[4]", 4},
       {"hidden.1.noise", "[4,1]", 4},
       {"hidden.1.weight", "[4,4]", 16},
       {"hidden.2.bias", "[4]", 4},
       {"hidden.2.weight", "[4,4]", 16},
       {"output.bias", "[3]", 3},
       {"output.weight", "[3,4]", 12},
       {"transforms", "[2,3,3]", 18}});
}
