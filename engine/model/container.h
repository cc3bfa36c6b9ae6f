// The safetensors container of models and texture spaces: from bytes to a document and tensors,
// with every extent checked, and back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "engine/model/model.h"

namespace solidtex::engine {

inline constexpr std::uint64_t max_header_bytes = 16 << 20;
inline constexpr std::uint64_t max_data_bytes = 512 << 20;
inline constexpr std::uint64_t max_file_bytes = 8 + max_header_bytes + max_data_bytes;

// What a container holds. `key` of the metadata has the document.
struct FileKind {
  const char *key, *what;
  std::vector<std::string> types;  // of its tensors
};
inline const FileKind model_file{"solidtex", "model", {"F32"}};
inline const FileKind space_file{"solidtex-space", "texture space", {"F32", "U8"}};

// Tensor in the bytes of the file. It may be unaligned.
struct TensorView {
  std::string type;
  std::vector<std::int64_t> shape;
  std::span<const std::byte> bytes;
};

struct Container {
  std::string document;  // JSON text
  std::map<std::string, TensorView> tensors;
};

// Reads a file that is not larger than a container can be.
std::vector<std::byte> read_bytes(const std::filesystem::path& path);

// Parses a file. The views refer to `bytes`. `label` is the file name in messages.
Container parse_container(std::span<const std::byte> bytes, const std::string& label,
                          const FileKind& kind);

// Returns the bytes of a file of float32 tensors.
std::vector<std::byte> container_bytes(const FileKind& kind, const std::string& document,
                                       const std::map<std::string, Tensor>& tensors);

// Hands out the tensors of a file: each exactly once, in the shape that the architecture needs.
class TensorSource {
 public:
  TensorSource(std::string label, const std::map<std::string, TensorView>& tensors)
      : label_(std::move(label)), tensors_(tensors) {}

  // Copies a tensor. Throws if it is missing, has another shape, or has a value that is not finite.
  Tensor take(const std::string& name, const std::vector<std::int64_t>& shape);

  // Copies the values of a U8 tensor with one axis.
  std::vector<std::byte> take_bytes(const std::string& name, std::size_t max_size);

  // Throws if a tensor of the file has not been taken.
  void expect_all_taken() const;

 private:
  const TensorView& find(const std::string& name, const std::string& expected) const;

  std::string label_;
  const std::map<std::string, TensorView>& tensors_;
  std::set<std::string> taken_;
};

}  // namespace solidtex::engine
