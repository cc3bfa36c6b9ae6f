#include "plugins/mesh/formats/ply_header.h"

#include <algorithm>
#include <array>
#include <utility>

#include "plugins/mesh/formats/polygon_mesh.h"
#include "plugins/mesh/formats/text.h"

namespace solidtex::mesh {
namespace {

constexpr std::array<std::pair<std::string_view, PlyType>, 22> kTypes = {{
    {"char", PlyType::int8},        {"int8", PlyType::int8},       {"uchar", PlyType::uint8},
    {"uint8", PlyType::uint8},      {"short", PlyType::int16},     {"int16", PlyType::int16},
    {"ushort", PlyType::uint16},    {"uint16", PlyType::uint16},   {"int", PlyType::int32},
    {"int32", PlyType::int32},      {"uint", PlyType::uint32},     {"uint32", PlyType::uint32},
    {"int64", PlyType::int64},      {"uint64", PlyType::uint64},   {"long", PlyType::int64},
    {"ulong", PlyType::uint64},     {"float", PlyType::float32},   {"float32", PlyType::float32},
    {"double", PlyType::float64},   {"float64", PlyType::float64}, {"longlong", PlyType::int64},
    {"ulonglong", PlyType::uint64},
}};

// The first line defines the line ending: a binary body may begin with the byte of LF or CR.
class HeaderLines {
 public:
  explicit HeaderLines(std::string_view content) : rest_(content) {
    const std::size_t end = content.find_first_of("\r\n");
    const bool is_cr = end != content.npos && content[end] == '\r';
    if (is_cr && !content.substr(end).starts_with("\r\n")) end_ = '\r';
  }

  std::optional<std::string_view> take() {
    const std::size_t end = rest_.find(end_);
    if (end == rest_.npos) return std::nullopt;
    std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(end + 1);
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
  }
  std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
  char end_ = '\n';
};

class HeaderReader {
 public:
  HeaderReader(const std::string& file, std::string_view content) : file_(file), lines_(content) {}

  PlyHeader read() {
    std::optional<std::string_view> line = lines_.take();
    if (line && take_word(*line) != "ply") {
      refuse(file_, "no PLY file", "\"ply\" as its first line");
    }
    while ((line = lines_.take())) {
      if (!read_line(*line)) return finish();
    }
    refuse(file_, "a header without an end", "\"end_header\" in a line of its own");
  }
  std::string_view rest() const { return lines_.rest(); }

 private:
  // False at the end.
  bool read_line(std::string_view line) {
    const std::string_view all = line, keyword = take_word(line);
    if (keyword == "end_header") return false;
    if (keyword.empty() || keyword == "comment" || keyword == "obj_info") return true;
    if (keyword == "format") {
      read_format(line, all);
    } else if (keyword == "element") {
      add_element(line, all);
    } else if (keyword == "property") {
      add_property(line, all);
    } else {
      refuse_line(all, "format, comment, obj_info, element, property or end_header");
    }
    return true;
  }

  void read_format(std::string_view line, std::string_view all) {
    const std::string_view name = take_word(line);
    has_format_ = true;
    if (name == "ascii") {
      header_.format = PlyHeader::Format::ascii;
    } else if (name == "binary_little_endian") {
      header_.format = PlyHeader::Format::little_endian;
    } else if (name == "binary_big_endian") {
      header_.format = PlyHeader::Format::big_endian;
    } else {
      refuse_line(all, "ascii, binary_little_endian or binary_big_endian");
    }
  }

  void add_element(std::string_view line, std::string_view all) {
    const std::string name(take_word(line));
    const auto count = to_integer(take_word(line));
    if (name.empty() || !count || *count < 0) refuse_line(all, "a name and a count");
    if (header_.find(name)) refuse_line(all, "elements of different names");
    header_.elements.push_back({name, static_cast<std::uint64_t>(*count)});
  }

  void add_property(std::string_view line, std::string_view all) {
    if (header_.elements.empty()) refuse_line(all, "an element before its properties");
    PlyProperty property;
    std::string_view word = take_word(line);
    if (word == "list") {
      property.count_type = type_of(take_word(line), all);
      if (*property.count_type >= PlyType::float32) refuse_line(all, "a whole number's type");
      word = take_word(line);
    }
    property.type = type_of(word, all);
    property.name = take_word(line);
    if (property.name.empty()) refuse_line(all, "a property with a name");
    header_.elements.back().properties.push_back(std::move(property));
  }

  PlyType type_of(std::string_view name, std::string_view all) const {
    const auto known =
        std::ranges::find(kTypes, name, &std::pair<std::string_view, PlyType>::first);
    if (known == kTypes.end()) refuse_line(all, "a type from char to double");
    return known->second;
  }

  [[noreturn]] void refuse_line(std::string_view line, const std::string& expected) const {
    refuse(file_, "the line " + quote(line) + " in the header", expected);
  }

  PlyHeader finish() {
    if (!has_format_) refuse(file_, "a header without a format", "the line \"format ascii 1.0\"");
    return std::move(header_);
  }

  const std::string& file_;
  HeaderLines lines_;
  PlyHeader header_;
  bool has_format_ = false;
};

}  // namespace

std::size_t size_of(PlyType type) {
  switch (type) {
    case PlyType::int8:
    case PlyType::uint8:
      return 1;
    case PlyType::int16:
    case PlyType::uint16:
      return 2;
    case PlyType::int32:
    case PlyType::uint32:
    case PlyType::float32:
      return 4;
    default:
      return 8;
  }
}

std::optional<std::size_t> PlyElement::find(std::initializer_list<std::string_view> names) const {
  for (std::size_t i = 0; i < properties.size(); ++i) {
    if (std::ranges::find(names, properties[i].name) != names.end()) return i;
  }
  return std::nullopt;
}

const PlyElement* PlyHeader::find(std::string_view name) const {
  const auto found = std::ranges::find(elements, name, &PlyElement::name);
  return found == elements.end() ? nullptr : &*found;
}

PlyHeader take_ply_header(const std::string& file, std::string_view& content) {
  HeaderReader reader(file, without_bom(content));
  PlyHeader header = reader.read();
  content = reader.rest();
  return header;
}

}  // namespace solidtex::mesh
