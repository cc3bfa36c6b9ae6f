// Header of a PLY file: its elements in order, with their properties.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace solidtex::mesh {

enum class PlyType { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };

std::size_t size_of(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::float32;
  std::optional<PlyType> count_type{};  // for lists
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties{};

  // Index of the first property that has one of these names.
  std::optional<std::size_t> find(std::initializer_list<std::string_view> names) const;
};

struct PlyHeader {
  enum class Format { ascii, little_endian, big_endian };

  Format format = Format::ascii;
  std::vector<PlyElement> elements;

  const PlyElement* find(std::string_view name) const;
};

// Parses the header and removes it: `content` then begins with the body. Throws MeshError.
PlyHeader take_ply_header(const std::string& file, std::string_view& content);

}  // namespace solidtex::mesh
