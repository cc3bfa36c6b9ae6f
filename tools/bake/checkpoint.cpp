#include "tools/bake/checkpoint.h"

#include <fmt/core.h>

#include <cerrno>
#include <cstring>
#include <string>

#include "plugins/common/fingerprint.h"
#include "tools/common/cli.h"
#include "tools/common/output_file.h"

namespace solidtex::tools {
namespace {

using nlohmann::ordered_json;

constexpr const char* kKind = "solidtex-bake checkpoint 1";

std::uint64_t fingerprint_of(std::span<const float> values) {
  Fingerprint fingerprint;
  fingerprint.add(values.data(), values.size_bytes());
  return fingerprint.value();
}

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& found,
                         const std::string& expected) {
  throw std::runtime_error(
      fmt::format("{}: found {}, expected {}", file.string(), found, expected));
}

[[noreturn]] void fail(const std::filesystem::path& file) {
  throw WriteError(file, std::strerror(errno));
}

// The file appears complete: there is never half a header.
void begin(const std::filesystem::path& file, const ordered_json& identity) {
  write_completely(file, [&](const std::filesystem::path& temporary) {
    const std::string header = std::string(kKind) + '\n' + identity.dump() + '\n';
    OutputFile stream(temporary);
    stream.write(0, header.data(), header.size());
    stream.close();
  });
}

void check_identity(const std::filesystem::path& file, std::istream& stream,
                    const ordered_json& identity) {
  std::string kind, header;
  if (!std::getline(stream, kind) || kind != kKind || !std::getline(stream, header)) {
    refuse(file, "another file", "a checkpoint of solidtex-bake");
  }
  const ordered_json found = ordered_json::parse(header, nullptr, false);
  if (!found.is_object()) refuse(file, "a damaged header", "a checkpoint of solidtex-bake");
  for (const auto& [key, value] : identity.items()) {
    const ordered_json other = found.value(key, ordered_json());
    if (other == value) continue;
    if (key == "model" || key == "mesh") {
      refuse(file, "a checkpoint of another " + key + ", or of this one before it was changed",
             "one of this " + key);
    }
    refuse(file, "a checkpoint with the " + key + " " + other.dump(), value.dump());
  }
}

}  // namespace

Checkpoint::Checkpoint(const std::filesystem::path& file, const ordered_json& identity)
    : file_(file) {
  const bool is_there = std::filesystem::exists(file);
  if (!is_there) begin(file, identity);
  stream_.open(file, std::ios::in | std::ios::out | std::ios::binary);
  if (!stream_) fail(file);
  check_identity(file, stream_, identity);
  end_ = stream_.tellg();
  if (is_there) say(fmt::format("{}: goes on from there", file.string()));
}

bool Checkpoint::read(std::span<float> values) {
  if (!stream_.is_open() || is_at_end_) return false;
  std::uint64_t fingerprint = 0;
  stream_.read(reinterpret_cast<char*>(values.data()),
               static_cast<std::streamsize>(values.size_bytes()));
  stream_.read(reinterpret_cast<char*>(&fingerprint), sizeof fingerprint);
  is_at_end_ = !stream_ || fingerprint != fingerprint_of(values);
  if (!is_at_end_) end_ = stream_.tellg();
  stream_.clear();
  return !is_at_end_;
}

void Checkpoint::append(std::span<const float> values) {
  if (!stream_.is_open()) return;
  const std::uint64_t fingerprint = fingerprint_of(values);
  stream_.seekp(end_);
  stream_.write(reinterpret_cast<const char*>(values.data()),
                static_cast<std::streamsize>(values.size_bytes()));
  stream_.write(reinterpret_cast<const char*>(&fingerprint), sizeof fingerprint);
  stream_.flush();
  if (!stream_) fail(file_);
  end_ = stream_.tellp();
}

}  // namespace solidtex::tools
