// The safetensors container: bytes to metadata and tensor views, every extent checked.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace solidtex::engine {

inline constexpr std::uint64_t max_header_bytes = 16 << 20;
inline constexpr std::uint64_t max_data_bytes = 512 << 20;
inline constexpr std::uint64_t max_file_bytes = 8 + max_header_bytes + max_data_bytes;

// A float32 tensor inside the file's bytes; possibly unaligned.
struct TensorView {
  std::vector<std::int64_t> shape;
  std::span<const std::byte> bytes;
};

struct Container {
  std::map<std::string, std::string> metadata;
  std::map<std::string, TensorView> tensors;
};

// The views refer to `bytes`. `label` stands for the file name in messages.
Container parse_container(std::span<const std::byte> bytes, const std::string& label);

}  // namespace solidtex::engine
