// Sequential readers of a PLY file's body.
#pragma once

#include <bit>
#include <cstring>
#include <string>
#include <string_view>

#include "plugins/mesh/formats/ply_header.h"
#include "plugins/mesh/formats/polygon_mesh.h"
#include "plugins/mesh/formats/text.h"

namespace solidtex::mesh {

// Thrown if the body ends too early.
struct PlyEnd {};

class PlyBinaryBody {
 public:
  PlyBinaryBody(std::string_view bytes, bool is_big_endian)
      : rest_(bytes), swaps_(is_big_endian != (std::endian::native == std::endian::big)) {}

  double take(PlyType type) {
    switch (type) {
      case PlyType::int8:
        return take_as<std::int8_t>();
      case PlyType::uint8:
        return take_as<std::uint8_t>();
      case PlyType::int16:
        return take_as<std::int16_t>();
      case PlyType::uint16:
        return take_as<std::uint16_t>();
      case PlyType::int32:
        return take_as<std::int32_t>();
      case PlyType::uint32:
        return take_as<std::uint32_t>();
      case PlyType::int64:
        return static_cast<double>(take_as<std::int64_t>());
      case PlyType::uint64:
        return static_cast<double>(take_as<std::uint64_t>());
      case PlyType::float32:
        return take_as<float>();
      default:
        return take_as<double>();
    }
  }
  void end_row() {}

  std::size_t bytes_left() const { return rest_.size(); }

 private:
  template <class T>
  T take_as() {
    if (rest_.size() < sizeof(T)) throw PlyEnd();
    char bytes[sizeof(T)];
    for (std::size_t i = 0; i < sizeof(T); ++i) bytes[i] = rest_[swaps_ ? sizeof(T) - 1 - i : i];
    rest_.remove_prefix(sizeof(T));
    return std::bit_cast<T>(bytes);
  }

  std::string_view rest_;
  bool swaps_;
};

// A row ends with its line. A row may continue in the next line, since some programs wrap lists.
class PlyAsciiBody {
 public:
  PlyAsciiBody(const std::string& file, std::string_view text) : file_(file), rest_(text) {}

  double take(PlyType) {
    skip_space();
    if (rest_.empty()) throw PlyEnd();
    std::size_t end = 0;
    while (end < rest_.size() && !is_blank(rest_[end]) && !is_line_end(rest_[end])) ++end;
    const std::string_view word = rest_.substr(0, end);
    const auto value = to_number(word);
    if (!value) refuse(file_, quote(word) + where(), "a number");
    rest_.remove_prefix(end);
    return *value;
  }

  void end_row() {
    ++row_;
    while (!rest_.empty() && is_blank(rest_[0])) rest_.remove_prefix(1);
    if (rest_.empty() || is_line_end(rest_[0])) return;
    refuse(file_, quote(take_word(rest_)) + where(),
           "as many values in each line as in the header");
  }

  std::size_t bytes_left() {
    skip_space();
    return rest_.size();
  }

 private:
  void skip_space() {
    while (!rest_.empty() && (is_blank(rest_[0]) || is_line_end(rest_[0]))) rest_.remove_prefix(1);
  }
  std::string where() const { return " in row " + std::to_string(row_) + " after the header"; }

  const std::string& file_;
  std::string_view rest_;
  std::uint64_t row_ = 0;
};

}  // namespace solidtex::mesh
