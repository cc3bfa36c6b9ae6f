// Valid texture spaces in a temporary folder, encoded independently of the reader.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

// Folder that is removed with this object.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "spaces-XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::string file(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

// Writes a sampler space of two octaves, width 3, code 2 and two photographs. Its encoder is an
// ONNX file with an empty graph.
inline void write_tiny_space(const std::string& path, float shift = 0) {
  nlohmann::json header;
  std::vector<float> values;
  const auto add = [&](const std::string& name, const std::vector<std::size_t>& shape) {
    const std::size_t begin = values.size() * sizeof(float);
    std::size_t count = 1;
    for (const std::size_t size : shape) count *= size;
    for (std::size_t i = 0; i < count; ++i)
      values.push_back(0.1f * static_cast<float>((7 * i + values.size()) % 11) - 0.4f + shift);
    header[name] = {{"dtype", "F32"},
                    {"shape", shape},
                    {"data_offsets", {begin, values.size() * sizeof(float)}}};
  };
  const auto add_layer = [&](const std::string& name, std::size_t outputs, std::size_t inputs) {
    add(name + ".weight", {outputs, inputs});
    add(name + ".bias", {outputs});
  };
  add("codes", {2, 2});
  add("colors", {2, 3, 4});
  for (const std::string name : {"style", "transforms"}) {
    add_layer(name + ".0", 4, 2);
    add_layer(name + ".1", name == "style" ? 4 : 18, 4);
  }
  add("scales", {2});
  add("constant", {3});
  for (const std::string name : {"hidden.0", "hidden.1", "hidden.2"}) {
    add_layer(name, 3, 3);
    add_layer("condition." + name, 6, 4);
    if (name != "hidden.2") add(name + ".noise", {3, 1});
  }
  add_layer("output", 3, 3);

  const nlohmann::json document = {{"version", 1},
                                   {"name", "tiny"},
                                   {"family", "sampler"},
                                   {"channels", {"albedo.r", "albedo.g", "albedo.b"}},
                                   {"color_space", "srgb"},
                                   {"colors", "photograph"},
                                   {"patch", 16},
                                   {"resolution", 32},
                                   {"code", 2},
                                   {"directions", "xyz"},
                                   {"noise", {{"scheme", "solidtex-1"}}},
                                   {"sampler",
                                    {{"octaves", 2},
                                     {"hidden_layers", 3},
                                     {"width", 3},
                                     {"slope", 0.2},
                                     {"transforms", "linear"}}},
                                   {"style", {{"width", 4}, {"slope", 0.2}}},
                                   {"photographs", {{{"name", "first"}}, {{"name", "second"}}}}};
  header["__metadata__"] = {{"solidtex-space", document.dump()}};
  const std::string encoder = {0x3A, 0x00};  // ModelProto.graph, empty
  const std::size_t end = values.size() * sizeof(float);
  header["encoder"] = {
      {"dtype", "U8"}, {"shape", {encoder.size()}}, {"data_offsets", {end, end + encoder.size()}}};
  const std::string text = header.dump();
  const std::uint64_t size = text.size();
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(&size), sizeof size);
  file << text;
  file.write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(end));
  file << encoder;
}
