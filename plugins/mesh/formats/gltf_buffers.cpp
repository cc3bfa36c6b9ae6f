#include "plugins/mesh/formats/gltf_buffers.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <limits>

#include "plugins/mesh/formats/readers.h"
#include "plugins/mesh/formats/text.h"

namespace solidtex::mesh {
namespace {

using nlohmann::json;

constexpr std::uint64_t kMaxNumber = 1ull << 48;  // sums and products of two stay exact

enum ComponentType { kByte = 5120, kUByte, kShort, kUShort, kUInt = 5125, kFloat };

std::size_t size_of_component(int type) {
  switch (type) {
    case kByte:
    case kUByte:
      return 1;
    case kShort:
    case kUShort:
      return 2;
    case kUInt:
    case kFloat:
      return 4;
    default:
      return 0;
  }
}

int width_of(const std::string& type) {
  if (type == "SCALAR") return 1;
  if (type == "VEC2") return 2;
  return type == "VEC3" ? 3 : 4;
}

// Little-endian.
template <class T>
T read_as(const char* bytes) {
  char copy[sizeof(T)];
  std::memcpy(copy, bytes, sizeof(T));
  if (std::endian::native == std::endian::big) std::reverse(copy, copy + sizeof(T));
  return std::bit_cast<T>(copy);
}

template <class T>
double read_integer(const char* bytes, bool is_normalized) {
  const double value = read_as<T>(bytes);
  return is_normalized ? std::max(value / std::numeric_limits<T>::max(), -1.0) : value;
}

std::string decode_base64(std::string_view text) {
  static constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const std::size_t digit = kDigits.find(c);
    if (digit == kDigits.npos) break;
    bits = bits << 6 | static_cast<std::uint32_t>(digit);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 0xff);
  }
  return bytes;
}

// "%20" is a space.
std::string decode_percent(const std::string& uri) {
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const auto digit = [&](std::size_t at) {
      return at < uri.size()
                 ? std::string("0123456789abcdef").find(in_small_letters(uri.substr(at, 1)))
                 : std::string::npos;
    };
    if (uri[i] == '%' && digit(i + 1) != uri.npos && digit(i + 2) != uri.npos) {
      text += static_cast<char>(16 * digit(i + 1) + digit(i + 2));
      i += 2;
    } else {
      text += uri[i];
    }
  }
  return text;
}

}  // namespace

double GltfArray::at(std::size_t element, int component) const {
  const char* data = bytes.data() + element * stride +
                     static_cast<std::size_t>(component) * size_of_component(component_type);
  switch (component_type) {
    case kByte:
      return read_integer<std::int8_t>(data, is_normalized);
    case kUByte:
      return read_integer<std::uint8_t>(data, is_normalized);
    case kShort:
      return read_integer<std::int16_t>(data, is_normalized);
    case kUShort:
      return read_integer<std::uint16_t>(data, is_normalized);
    case kUInt:
      return read_integer<std::uint32_t>(data, is_normalized);
    default:
      return read_as<float>(data);
  }
}

GltfDocument::GltfDocument(const std::string& file, std::string_view content)
    : file_(file), text_(without_bom(content)) {
  if (content.starts_with("glTF")) take_chunks(content);
  try {
    json_ = json::parse(text_.begin(), text_.end());
  } catch (const json::exception& error) {
    refuse(std::string("what is no JSON (") + error.what() + ")", "a glTF document");
  }
  if (!json_.is_object() || !json_.contains("asset")) refuse("no \"asset\"", "a glTF document");
  const json& asset = json_["asset"];
  const std::string version = asset.is_object() ? asset.value("version", json()).dump() : "none";
  if (!version.starts_with("\"2")) refuse("version " + version, "glTF \"2.0\": export it again");
  load_buffers();
}

void GltfDocument::refuse(const std::string& found, const std::string& expected) const {
  mesh::refuse(file_, found, expected);
}

// A header of 12 bytes, then chunks: length, type, data. The first one is JSON, the next one
// binary.
void GltfDocument::take_chunks(std::string_view content) {
  constexpr std::size_t kHeader = 12, kChunkHeader = 8;
  if (content.size() < kHeader) refuse("a header cut short", "a glTF file");
  if (const auto version = read_as<std::uint32_t>(content.data() + 4); version != 2) {
    refuse("version " + std::to_string(version), "glTF 2.0");
  }
  const auto promised = read_as<std::uint32_t>(content.data() + 8);
  if (promised > content.size()) {
    refuse(count_of(content.size(), "byte") + " of the " + std::to_string(promised) +
               " that the header promises",
           "all: the file is cut short, copy or export it again");
  }
  std::string_view rest = content.substr(kHeader);
  text_ = {};
  while (rest.size() >= kChunkHeader) {
    const auto size = read_as<std::uint32_t>(rest.data());
    const std::string_view type = rest.substr(4, 4);
    rest.remove_prefix(kChunkHeader);
    if (size > rest.size()) refuse("a chunk cut short", count_of(size, "byte"));
    if (type == "JSON" && text_.empty()) text_ = rest.substr(0, size);
    if (type == std::string_view("BIN\0", 4) && !has_chunk_) {
      chunk_ = rest.substr(0, size);
      has_chunk_ = true;
    }
    rest.remove_prefix(size);
  }
}

const json& GltfDocument::element(const char* array, std::uint64_t index) const {
  const auto found = json_.find(array);
  if (found == json_.end() || !found->is_array() || index >= found->size() ||
      !(*found)[index].is_object()) {
    refuse("a reference to \"" + std::string(array) + "\" " + std::to_string(index),
           "one that is there");
  }
  return (*found)[index];
}

std::uint64_t GltfDocument::number(const json& object, const char* name,
                                   std::uint64_t otherwise) const {
  const auto found = object.find(name);
  if (found == object.end()) return otherwise;
  if (found->is_number_unsigned() && found->get<std::uint64_t>() <= kMaxNumber) {
    return found->get<std::uint64_t>();
  }
  refuse("a \"" + std::string(name) + "\" that is no count", "a whole number from 0 on");
}

void GltfDocument::load_buffers() {
  const auto buffers = json_.find("buffers");
  if (buffers == json_.end()) return;
  for (std::size_t i = 0; i < buffers->size(); ++i) {
    const json& buffer = element("buffers", i);
    buffers_.push_back(buffer_of(buffer, i == 0));
    const std::uint64_t promised = number(buffer, "byteLength", 0);
    if (buffers_.back().size() >= promised) continue;
    refuse(count_of(buffers_.back().size(), "byte") + " in buffer " + std::to_string(i),
           std::to_string(promised) + ": a file is cut short, copy or export it again");
  }
}

std::string GltfDocument::buffer_of(const json& buffer, bool is_first) const {
  const auto uri = buffer.find("uri");
  if (uri == buffer.end()) {
    if (is_first && has_chunk_) return std::string(chunk_);
    refuse("a buffer without data", "an \"uri\", or a .glb file");
  }
  if (!uri->is_string()) refuse("an \"uri\" that is no text", "the name of a file");
  const std::string text = uri->get<std::string>();
  if (text.starts_with("data:")) {
    const std::size_t begin = text.find(";base64,");
    if (begin == text.npos) refuse("data of an unknown encoding", "base64");
    return decode_base64(std::string_view(text).substr(begin + 8));
  }
  const auto path = std::filesystem::path(file_).parent_path() / decode_percent(text);
  std::error_code unreachable;  // such as a name that is too long
  if (!std::filesystem::is_regular_file(path, unreachable)) {
    refuse("no file " + quote(text) + " beside it", "the one with its data");
  }
  return read_bytes(path);
}

std::string_view GltfDocument::view(std::uint64_t index) const {
  const json& view = element("bufferViews", index);
  const std::uint64_t buffer = number(view, "buffer", kMaxNumber);
  const std::uint64_t offset = number(view, "byteOffset", 0), size = number(view, "byteLength", 0);
  if (buffer >= buffers_.size() || offset + size > buffers_[buffer].size()) {
    refuse("the buffer view " + std::to_string(index) + " beyond its buffer", "one inside");
  }
  return std::string_view(buffers_[buffer]).substr(offset, size);
}

GltfArray GltfDocument::array(std::uint64_t accessor, int width) const {
  const json& object = element("accessors", accessor);
  const std::string name = "the accessor " + std::to_string(accessor);
  if (object.contains("sparse")) {
    refuse(name + " that is sparse", "one with all values: export it without sparse accessors");
  }
  if (!object.contains("bufferView")) {
    refuse(name + " without data of its own", "plain triangles: export it without compression");
  }
  GltfArray array;
  array.component_type = static_cast<int>(number(object, "componentType", 0));
  const auto type = object.find("type");
  array.width = type != object.end() && type->is_string() ? width_of(type->get<std::string>()) : 0;
  const std::size_t size =
      size_of_component(array.component_type) * static_cast<std::size_t>(width);
  if (size == 0 || array.width != width)
    refuse(name + " of another type", "numbers by " + std::to_string(width));
  const auto normalized = object.find("normalized");
  array.is_normalized = normalized != object.end() && *normalized == true;

  const std::uint64_t view_index = number(object, "bufferView", 0);
  array.bytes = view(view_index);
  array.stride = number(element("bufferViews", view_index), "byteStride", size);
  array.count = number(object, "count", 0);
  const std::uint64_t offset = number(object, "byteOffset", 0);
  if (array.count == 0) return array;
  const bool fits = offset <= array.bytes.size() && array.stride > 0 &&
                    size <= array.bytes.size() - offset &&
                    array.count - 1 <= (array.bytes.size() - offset - size) / array.stride;
  if (!fits) {
    refuse(name + " with " + count_of(array.count, "element") + " beyond its buffer view",
           "one inside");
  }
  array.bytes.remove_prefix(offset);
  return array;
}

}  // namespace solidtex::mesh
