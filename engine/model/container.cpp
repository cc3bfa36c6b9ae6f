#include "engine/model/container.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <string_view>

#include "engine/model/checks.h"
#include "engine/model/json_text.h"

namespace solidtex::engine {
namespace {

using nlohmann::json;

constexpr std::size_t max_rank = 5, kMaxBeginning = 256;
constexpr std::int64_t max_elements = max_data_bytes / sizeof(float);

struct Extent {
  std::size_t begin = 0, end = 0;
  std::string name;
};

struct OtherContent {
  std::string_view beginning;  // lower case
  const char *what, *remedy;
};

// Contents that are often found in place of a model.
constexpr OtherContent kOtherContents[] = {
    {"version https://git-lfs.github.com/spec/", "a Git LFS pointer", "run git lfs pull"},
    {"<!doctype", "an HTML page", "download the file itself, not its page"},
    {"<html", "an HTML page", "download the file itself, not its page"},
    {"<?xml", "an XML document", "download the file itself"},
    {"pk\3\4", "a ZIP archive or PyTorch checkpoint", "unpack or export it first"},
};

// Throws if the file is empty or something else. None of these beginnings is a valid header length.
void refuse_other_content(std::span<const std::byte> bytes, const std::string& label,
                          const FileKind& kind) {
  const std::string wanted = kind.what;
  if (bytes.empty())
    throw invalid(label, "header length", "an empty file of 0 bytes",
                  "a " + wanted + ": copy or download the file again");
  std::string begin(reinterpret_cast<const char*>(bytes.data()),
                    std::min<std::size_t>(bytes.size(), kMaxBeginning));
  std::ranges::transform(begin, begin.begin(), [](unsigned char c) { return std::tolower(c); });
  if (begin.starts_with("\xEF\xBB\xBF")) begin.erase(0, 3);  // byte order mark
  begin.erase(0, begin.find_first_not_of(" \t\r\n"));
  for (const auto& [beginning, what, remedy] : kOtherContents)
    if (begin.starts_with(beginning))
      throw Error(SOLIDTEX_INVALID_MODEL,
                  label + ": this is " + what + ", not the " + wanted + ": " + remedy);
}

std::uint64_t header_size(std::span<const std::byte> bytes, const std::string& label,
                          const FileKind& kind) {
  refuse_other_content(bytes, label, kind);
  if (bytes.size() < 8)
    throw invalid(label, "header length", "a file of " + std::to_string(bytes.size()) + " bytes",
                  "at least 8 bytes");
  std::uint64_t size = 0;
  for (int i = 7; i >= 0; --i) size = (size << 8) | std::to_integer<std::uint64_t>(bytes[i]);
  const std::uint64_t limit = std::min<std::uint64_t>(bytes.size() - 8, max_header_bytes);
  if (size > limit)
    throw invalid(label, "header length", std::to_string(size) + " bytes",
                  "at most " + std::to_string(limit) + " bytes (file size, and a limit of " +
                      std::to_string(max_header_bytes) + "): " +
                      (size > max_header_bytes
                           ? "this is no " + std::string(kind.what) + ", export it from a result"
                           : "the file is cut short, copy it again"));
  return size;
}

std::vector<std::int64_t> read_shape(const Fields& entry) {
  std::vector<std::int64_t> shape;
  std::int64_t elements = 1;
  for (const json& value : entry.array("shape", 1, max_rank)) {
    const std::int64_t size = as_integer(value).value_or(0);
    if (size < 1) throw entry.wrong("shape", "positive integers");
    if (size > max_elements / elements)  // before the product can overflow
      throw entry.wrong("shape",
                        "a tensor of at most " + std::to_string(max_data_bytes) + " bytes");
    shape.push_back(size);
    elements *= size;
  }
  return shape;
}

Extent read_extent(const Fields& entry, const std::string& name, std::size_t data_bytes) {
  const json& offsets = entry.array("data_offsets", 2, 2);
  const std::int64_t limit = static_cast<std::int64_t>(data_bytes);
  const std::int64_t begin = as_integer(offsets[0]).value_or(-1);
  const std::int64_t end = as_integer(offsets[1]).value_or(-1);
  const char* remedy = ": the file seems to be cut short, copy or download it again";
  if (begin < 0 || begin > limit || end < 0 || end > limit)
    throw entry.wrong("data_offsets", "two integers from 0 to " + std::to_string(limit) +
                                          (begin < 0 || end < 0 ? "" : remedy));
  return {static_cast<std::size_t>(begin), static_cast<std::size_t>(end), name};
}

void check_size(const Fields& entry, const Extent& extent, const std::vector<std::int64_t>& shape) {
  std::size_t expected = entry.string("dtype") == "U8" ? 1 : sizeof(float);
  for (const std::int64_t size : shape) expected *= static_cast<std::size_t>(size);
  if (extent.end < extent.begin || extent.end - extent.begin != expected)
    throw entry.wrong("data_offsets",
                      std::to_string(expected) + " bytes for shape " + show_shape(shape));
}

void check_contiguous(std::vector<Extent> extents, std::size_t data_bytes,
                      const std::string& label) {
  std::ranges::sort(extents, {}, &Extent::begin);
  std::size_t position = 0;
  for (const Extent& extent : extents) {
    if (extent.begin != position)
      throw invalid(label, "tensor " + show(extent.name),
                    (extent.begin > position ? "a hole before byte " : "an overlap at byte ") +
                        std::to_string(extent.begin) + " of the tensor data",
                    "to begin at byte " + std::to_string(position));
    position = extent.end;
  }
  if (position != data_bytes)
    throw invalid(label, "tensor data",
                  std::to_string(data_bytes - position) + " bytes after the last tensor", "none");
}

// Returns the document. The metadata may hold more strings, which other tools put there.
std::string read_document(const json& header, const std::string& label, const FileKind& kind) {
  if (const auto metadata = header.find("__metadata__"); metadata != header.end()) {
    const auto is_string = [](const json& entry) { return entry.is_string(); };
    if (!metadata->is_object() || !std::ranges::all_of(*metadata, is_string))
      throw invalid(label, "__metadata__", show(*metadata), "an object of strings");
    if (const auto found = metadata->find(kind.key); found != metadata->end())
      return found->get<std::string>();
    for (const FileKind& other : {model_file, space_file})
      if (metadata->contains(other.key))
        throw Error(SOLIDTEX_INVALID_MODEL,
                    label + ": this is a " + other.what + ", expected a " + kind.what);
  }
  throw invalid(label, std::string("__metadata__.") + kind.key, "nothing",
                "the " + std::string(kind.what) + "'s JSON document");
}

// Copies values between a file, whose bytes are little-endian, and memory.
template <class Value>
void copy_values(void* to, const void* from, std::size_t count) {
  std::memcpy(to, from, count * sizeof(Value));
  if constexpr (std::endian::native == std::endian::big) {
    auto* bytes = static_cast<std::byte*>(to);
    for (std::size_t i = 0; i < count; ++i, bytes += sizeof(Value))
      std::reverse(bytes, bytes + sizeof(Value));
  }
}

Error unreadable(const std::filesystem::path& path, const std::string& why) {
  return Error(SOLIDTEX_IO_ERROR, path.string() + ": cannot read: " + why);
}

}  // namespace

std::vector<std::byte> read_bytes(const std::filesystem::path& path) {
  std::error_code problem;
  const auto status = std::filesystem::status(path, problem);
  if (problem) throw unreadable(path, problem.message());
  if (!std::filesystem::is_regular_file(status)) throw unreadable(path, "not a regular file");
  const std::uintmax_t size = std::filesystem::file_size(path, problem);
  if (problem) throw unreadable(path, problem.message());
  if (size > max_file_bytes)
    throw invalid(path.string(), "file size", std::to_string(size) + " bytes",
                  "at most " + std::to_string(max_file_bytes));
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file && errno == ENOMEM) throw std::bad_alloc();
  if (!file) throw unreadable(path, std::strerror(errno));
  std::vector<std::byte> bytes(size);
  if (!file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size)))
    throw unreadable(path, "it ended after " + std::to_string(file.gcount()) + " of " +
                               std::to_string(size) + " bytes");
  return bytes;
}

Container parse_container(std::span<const std::byte> bytes, const std::string& label,
                          const FileKind& kind) {
  const std::uint64_t header_bytes = header_size(bytes, label, kind);
  const auto data = bytes.subspan(8 + header_bytes);
  if (data.size() > max_data_bytes)
    throw invalid(label, "tensor data", std::to_string(data.size()) + " bytes",
                  "at most " + std::to_string(max_data_bytes));
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()) + 8, header_bytes);
  const JsonDocument parsed(label, "header", text);
  const json& header = parsed.root();

  Container result{read_document(header, label, kind), {}};
  std::vector<Extent> extents;
  for (const auto& [name, value] : header.items()) {
    if (name == "__metadata__") continue;
    const std::string where = "tensor " + show(name);
    check_name(label, where, name);
    const Fields entry(label, where, value);
    entry.allow_only({"dtype", "shape", "data_offsets"});
    const std::string type = entry.choice("dtype", kind.types);
    auto shape = read_shape(entry);
    const Extent extent = read_extent(entry, name, data.size());
    check_size(entry, extent, shape);
    extents.push_back(extent);
    result.tensors[name] = {type, std::move(shape),
                            data.subspan(extent.begin, extent.end - extent.begin)};
  }
  check_contiguous(std::move(extents), data.size(), label);
  return result;
}

std::vector<std::byte> container_bytes(const FileKind& kind, const std::string& document,
                                       const std::map<std::string, Tensor>& tensors) {
  ObjectText header;
  header.add_text("__metadata__", ObjectText().add(kind.key, document).text());
  std::size_t data_bytes = 0;
  for (const auto& [name, tensor] : tensors) {
    const std::size_t begin = data_bytes;
    data_bytes += tensor.values.size() * sizeof(float);
    const std::array<std::size_t, 2> offsets = {begin, data_bytes};
    header.add_text(name, ObjectText()
                              .add("dtype", "F32")
                              .add_text("shape", array_text(tensor.shape))
                              .add_text("data_offsets", array_text(offsets))
                              .text());
  }
  std::string text = header.text();
  text.resize((text.size() + 7) / 8 * 8, ' ');  // aligns the tensors
  std::vector<std::byte> bytes(8 + text.size() + data_bytes);
  const std::uint64_t header_bytes = text.size();
  std::byte* at = bytes.data();
  copy_values<std::uint64_t>(at, &header_bytes, 1);
  at = std::ranges::copy(std::as_bytes(std::span(text)), at + sizeof header_bytes).out;
  for (const auto& [name, tensor] : tensors) {
    copy_values<float>(at, tensor.values.data(), tensor.values.size());
    at += tensor.values.size() * sizeof(float);
  }
  return bytes;
}

const TensorView& TensorSource::find(const std::string& name, const std::string& expected) const {
  const auto entry = tensors_.find(name);
  if (entry == tensors_.end()) throw invalid(label_, "tensor " + show(name), "nothing", expected);
  return entry->second;
}

Tensor TensorSource::take(const std::string& name, const std::vector<std::int64_t>& shape) {
  const std::string where = "tensor " + show(name);
  const TensorView& view = find(name, "F32 of shape " + show_shape(shape));
  if (view.shape != shape)
    throw invalid(label_, where, "shape " + show_shape(view.shape), "shape " + show_shape(shape));
  if (view.type != "F32") throw invalid(label_, where, "type " + view.type, "F32");

  Tensor tensor{shape, std::vector<float>(view.bytes.size() / sizeof(float))};
  copy_values<float>(tensor.values.data(), view.bytes.data(), tensor.values.size());
  const auto bad =
      std::ranges::find_if_not(tensor.values, [](float v) { return std::isfinite(v); });
  if (bad != tensor.values.end())
    throw invalid(
        label_, where,
        std::to_string(*bad) + " at element " + std::to_string(bad - tensor.values.begin()),
        "finite values");
  taken_.insert(name);
  return tensor;
}

std::vector<std::byte> TensorSource::take_bytes(const std::string& name, std::size_t max_size) {
  const std::string expected = "U8 of 1 to " + std::to_string(max_size) + " bytes";
  const TensorView& view = find(name, expected);
  if (view.type != "U8" || view.shape.size() != 1 || view.bytes.size() > max_size)
    throw invalid(label_, "tensor " + show(name), view.type + " of shape " + show_shape(view.shape),
                  expected);
  taken_.insert(name);
  return {view.bytes.begin(), view.bytes.end()};
}

void TensorSource::expect_all_taken() const {
  for (const auto& [name, view] : tensors_)
    if (!taken_.contains(name))
      throw invalid(label_, "tensor " + show(name), "shape " + show_shape(view.shape),
                    "no such tensor in this architecture");
}

}  // namespace solidtex::engine
