#include "engine/model/container.h"

#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstring>
#include <string_view>

#include "engine/model/checks.h"

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
  const char* what;
};

// Contents that are often found in place of a model, with the remedy.
constexpr OtherContent kOtherContents[] = {
    {"version https://git-lfs.github.com/spec/",
     "a Git LFS pointer, not the model: run git lfs pull"},
    {"<!doctype", "an HTML page, not the model: download the file itself, not its page"},
    {"<html", "an HTML page, not the model: download the file itself, not its page"},
    {"<?xml", "an XML document, not the model: download the file itself"},
    {"pk\3\4", "a ZIP archive or PyTorch checkpoint, not the model: unpack or export it first"},
};

// Throws if the file is empty or something else. None of these beginnings is a valid header length.
void refuse_other_content(std::span<const std::byte> bytes, const std::string& label) {
  if (bytes.empty())
    throw invalid(label, "header length", "an empty file of 0 bytes",
                  "a model: copy or download the file again");
  std::string begin(reinterpret_cast<const char*>(bytes.data()),
                    std::min<std::size_t>(bytes.size(), kMaxBeginning));
  std::ranges::transform(begin, begin.begin(), [](unsigned char c) { return std::tolower(c); });
  if (begin.starts_with("\xEF\xBB\xBF")) begin.erase(0, 3);  // byte order mark
  begin.erase(0, begin.find_first_not_of(" \t\r\n"));
  for (const auto& [beginning, what] : kOtherContents)
    if (begin.starts_with(beginning))
      throw Error(SOLIDTEX_INVALID_MODEL, label + ": this is " + what);
}

std::uint64_t header_size(std::span<const std::byte> bytes, const std::string& label) {
  refuse_other_content(bytes, label);
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
                      (size > max_header_bytes ? "this is no model, export it from a result"
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
  if (begin < 0 || begin > limit || end < 0 || end > limit)
    throw entry.wrong("data_offsets", "two integers from 0 to " + std::to_string(limit));
  return {static_cast<std::size_t>(begin), static_cast<std::size_t>(end), name};
}

void check_size(const Fields& entry, const Extent& extent, const std::vector<std::int64_t>& shape) {
  std::size_t expected = sizeof(float);
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

std::map<std::string, std::string> read_metadata(const json& value, const std::string& label) {
  const auto is_string = [](const json& entry) { return entry.is_string(); };
  if (!value.is_object() || !std::ranges::all_of(value, is_string))
    throw invalid(label, "__metadata__", show(value), "an object of strings");
  return value.get<std::map<std::string, std::string>>();
}

}  // namespace

Container parse_container(std::span<const std::byte> bytes, const std::string& label) {
  const std::uint64_t header_bytes = header_size(bytes, label);
  const auto data = bytes.subspan(8 + header_bytes);
  if (data.size() > max_data_bytes)
    throw invalid(label, "tensor data", std::to_string(data.size()) + " bytes",
                  "at most " + std::to_string(max_data_bytes));
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()) + 8, header_bytes);
  const json header = parse_json(label, "header", text);

  Container result;
  std::vector<Extent> extents;
  for (const auto& [name, value] : header.items()) {
    if (name == "__metadata__") {
      result.metadata = read_metadata(value, label);
      continue;
    }
    const std::string where = "tensor " + show(name);
    check_name(label, where, name);
    const Fields entry(label, where, value);
    entry.allow_only({"dtype", "shape", "data_offsets"});
    entry.choice("dtype", {"F32"});
    auto shape = read_shape(entry);
    const Extent extent = read_extent(entry, name, data.size());
    check_size(entry, extent, shape);
    extents.push_back(extent);
    result.tensors[name] = {std::move(shape),
                            data.subspan(extent.begin, extent.end - extent.begin)};
  }
  check_contiguous(std::move(extents), data.size(), label);
  return result;
}

static_assert(std::endian::native == std::endian::little, "tensors are copied as they are");

Tensor TensorSource::take(const std::string& name, const std::vector<std::int64_t>& shape) {
  const std::string where = "tensor " + show(name);
  const auto entry = tensors_.find(name);
  if (entry == tensors_.end())
    throw invalid(label_, where, "nothing", "F32 of shape " + show_shape(shape));
  const TensorView& view = entry->second;
  if (view.shape != shape)
    throw invalid(label_, where, "shape " + show_shape(view.shape), "shape " + show_shape(shape));

  Tensor tensor{shape, std::vector<float>(view.bytes.size() / sizeof(float))};
  std::memcpy(tensor.values.data(), view.bytes.data(), view.bytes.size());
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

void TensorSource::expect_all_taken() const {
  for (const auto& [name, view] : tensors_)
    if (!taken_.contains(name))
      throw invalid(label_, "tensor " + show(name), "shape " + show_shape(view.shape),
                    "no such tensor in this architecture");
}

}  // namespace solidtex::engine
