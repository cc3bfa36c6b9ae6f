// Binary data of a glTF file, addressed by accessors.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace solidtex::mesh {

// Array of vectors in a buffer. Every element is inside the buffer.
struct GltfArray {
  std::string_view bytes;
  std::size_t count = 0, stride = 0;
  int component_type = 0, width = 0;
  bool is_normalized = false;

  double at(std::size_t element, int component) const;
};

class GltfDocument {
 public:
  // Parses a .gltf or .glb file and reads the buffers that it names. Throws MeshError.
  GltfDocument(const std::string& file, std::string_view content);

  const std::string& file() const { return file_; }
  const nlohmann::json& root() const { return json_; }

  // Returns an element of an array of the document ("nodes" ...).
  const nlohmann::json& element(const char* array, std::uint64_t index) const;

  // Returns an integer member, or `otherwise` without one.
  std::uint64_t number(const nlohmann::json& object, const char* name,
                       std::uint64_t otherwise) const;

  // Returns the data of an accessor of vectors with `width` components.
  GltfArray array(std::uint64_t accessor, int width) const;

  [[noreturn]] void refuse(const std::string& found, const std::string& expected) const;

 private:
  void take_chunks(std::string_view content);
  void load_buffers();
  std::string buffer_of(const nlohmann::json& buffer, bool is_first) const;
  std::string_view view(std::uint64_t index) const;

  std::string file_;
  nlohmann::json json_;
  std::string_view text_, chunk_;
  bool has_chunk_ = false;
  std::vector<std::string> buffers_;
};

}  // namespace solidtex::mesh
