// The safetensors container: from bytes to metadata and tensors, with every extent checked.
#pragma once

#include <cstddef>
#include <cstdint>
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

// Float32 tensor in the bytes of the file. It may be unaligned.
struct TensorView {
  std::vector<std::int64_t> shape;
  std::span<const std::byte> bytes;
};

struct Container {
  std::map<std::string, std::string> metadata;
  std::map<std::string, TensorView> tensors;
};

// Parses a file. The views refer to `bytes`. `label` is the file name in messages.
Container parse_container(std::span<const std::byte> bytes, const std::string& label);

// Hands out the tensors of a file: each exactly once, in the shape that the architecture needs.
class TensorSource {
 public:
  TensorSource(std::string label, const std::map<std::string, TensorView>& tensors)
      : label_(std::move(label)), tensors_(tensors) {}

  // Copies a tensor. Throws if it is missing, has another shape, or has a value that is not finite.
  Tensor take(const std::string& name, const std::vector<std::int64_t>& shape);

  // Throws if a tensor of the file has not been taken.
  void expect_all_taken() const;

 private:
  std::string label_;
  const std::map<std::string, TensorView>& tensors_;
  std::set<std::string> taken_;
};

}  // namespace solidtex::engine
