#include "tools/bake/zarr/shard_file.h"

#include <fmt/core.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>
#include <stdexcept>

namespace solidtex::tools {
namespace {

constexpr std::uint64_t missing = std::numeric_limits<std::uint64_t>::max();
constexpr std::size_t checksum_size = sizeof(std::uint32_t);

std::size_t place_in_index(std::size_t channel, const Index3& place, std::int64_t along_edge) {
  const auto [x, y, z] = place;
  const std::int64_t channels_before = static_cast<std::int64_t>(channel);
  return static_cast<std::size_t>(
      ((channels_before * along_edge + z) * along_edge + y) * along_edge + x);
}

std::size_t chunk_count(const StoreLayout& layout, int level) {
  const std::int64_t along_edge = layout.chunks_along_edge(level);
  return static_cast<std::size_t>(layout.channels * along_edge * along_edge * along_edge);
}

std::span<const unsigned char> bytes_of(const std::vector<std::uint64_t>& index) {
  return {reinterpret_cast<const unsigned char*>(index.data()), index.size() * 8};
}

// The file ends with its own checksum.
bool is_intact(std::span<const unsigned char> bytes) {
  if (bytes.size() < checksum_size) return false;
  std::uint32_t expected = 0;
  std::memcpy(&expected, bytes.last(checksum_size).data(), checksum_size);
  return crc32c(bytes.first(bytes.size() - checksum_size)) == expected;
}

const std::filesystem::path& held_by_nobody(const std::filesystem::path& path) {
  if (remove_abandoned(path)) return path;
  throw std::runtime_error(path.string() + ": another process is writing it");
}

class ShardReader {
 public:
  explicit ShardReader(const std::filesystem::path& path) : stream_(path, std::ios::binary) {}
  bool is_open() const { return stream_.is_open(); }

  // False if the file is shorter.
  bool read(std::uint64_t offset, std::size_t size, ChunkBytes& bytes) {
    bytes.resize(size);
    stream_.seekg(static_cast<std::streamoff>(offset));
    stream_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
    return static_cast<bool>(stream_);
  }

 private:
  std::ifstream stream_;
};

}  // namespace

ShardFile::ShardFile(const std::filesystem::path& path, const StoreLayout& layout, int level)
    : atomic_(held_by_nobody(path)),
      file_(atomic_.temporary_path(), path),
      chunks_along_edge_(layout.chunks_along_edge(level)),
      index_(2 * chunk_count(layout, level), missing) {}

void ShardFile::append(std::size_t channel, const Index3& place, const ChunkBytes& bytes) {
  const std::size_t at = 2 * place_in_index(channel, place, chunks_along_edge_);
  index_[at] = end_;
  index_[at + 1] = bytes.size();
  file_.write(end_, bytes.data(), bytes.size());
  end_ += bytes.size();
}

void ShardFile::finish() {
  const auto bytes = bytes_of(index_);
  const std::uint32_t checksum = crc32c(bytes);
  file_.write(end_, bytes.data(), bytes.size());
  file_.write(end_ + bytes.size(), &checksum, sizeof checksum);
  file_.sync();
  file_.close();
  atomic_.commit();
  sync_folder(atomic_.target().parent_path());
}

std::string shard_problem(const std::filesystem::path& path, const StoreLayout& layout, int level,
                          const Index3& position) {
  std::error_code problem;
  const std::uint64_t size = std::filesystem::file_size(path, problem);
  if (problem) return problem.message();
  std::vector<std::uint64_t> index(2 * chunk_count(layout, level));
  const std::size_t index_size = bytes_of(index).size() + checksum_size;
  if (size < index_size) return fmt::format("found {} bytes, too few for its index", size);
  ShardReader reader(path);
  if (!reader.is_open()) return std::string("cannot read: ") + std::strerror(errno);
  ChunkBytes bytes;
  if (!reader.read(size - index_size, index_size, bytes) || !is_intact(bytes))
    return "the checksum of its index does not match";
  std::memcpy(index.data(), bytes.data(), index_size - checksum_size);

  const Box box = layout.shard_box(level, position);
  const std::int64_t edge = layout.chunk_edge(level), along_edge = layout.chunks_along_edge(level);
  const auto has = [&](std::size_t axis, std::int64_t at) { return at * edge < box.size[axis]; };
  std::uint64_t used = 0;
  for (std::size_t i = 0; i < index.size(); i += 2) {
    const auto chunk = static_cast<std::int64_t>(i / 2);
    const bool is_inside = has(0, chunk % along_edge) && has(1, chunk / along_edge % along_edge) &&
                           has(2, chunk / along_edge / along_edge % along_edge);
    if ((index[i] != missing) != is_inside) return fmt::format("chunk {} is missing", i / 2);
    if (!is_inside) continue;
    if (index[i + 1] > size || index[i] > size - index[i + 1] ||
        !reader.read(index[i], index[i + 1], bytes) || !is_intact(bytes))
      return fmt::format("the checksum of chunk {} does not match", i / 2);
    used += index[i + 1];
  }
  return used + index_size == size ? "" : "found bytes of no chunk";
}

}  // namespace solidtex::tools
