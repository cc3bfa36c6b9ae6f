#include <openvdb/openvdb.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iostream>
#include <stdexcept>

#include "tools/bake/channels.h"
#include "tools/bake/sink.h"
#include "tools/common/limits.h"
#include "tools/common/output_file.h"

namespace solidtex::tools {
namespace {

openvdb::Vec3f value_at(const float* voxel, const ChannelGroup& group, const openvdb::Vec3SGrid&) {
  return {voxel[group.channels[0]], voxel[group.channels[1]], voxel[group.channels[2]]};
}

float value_at(const float* voxel, const ChannelGroup& group, const openvdb::FloatGrid&) {
  return voxel[group.channels[0]];
}

// Every voxel of the piece becomes active, zeros too: the volume is dense.
template <class Grid>
void fill(Grid& grid, const Volume& volume, const Piece& piece, const ChannelGroup& group) {
  auto accessor = grid.getAccessor();
  const float* voxel = piece.values.data();
  for (std::int64_t x = 0; x < piece.size[0]; ++x) {
    for (std::int64_t y = 0; y < piece.size[1]; ++y) {
      for (std::int64_t z = 0; z < piece.size[2]; ++z, voxel += volume.channels()) {
        const auto index = [&](int axis, std::int64_t step) {
          return static_cast<std::int32_t>(volume.origin[axis] + piece.offset[axis] + step);
        };
        accessor.setValueOn({index(0, x), index(1, y), index(2, z)}, value_at(voxel, group, grid));
      }
    }
  }
}

openvdb::GridBase::Ptr make_grid(const Volume& volume, const ChannelGroup& group) {
  openvdb::GridBase::Ptr grid;
  if (group.channels.size() == 3) {
    grid = openvdb::Vec3SGrid::create();
  } else {
    grid = openvdb::FloatGrid::create();
  }
  grid->setName(group.name);
  // World coordinates are texels: voxel i is sampled at its center, i + 0.5.
  const auto transform = openvdb::math::Transform::createLinearTransform(1.0);
  transform->postTranslate({0.5, 0.5, 0.5});
  grid->setTransform(transform);
  const char* const encodings[] = {"srgb", "linear", "data"};
  grid->insertMeta("solidtex_encoding",
                   openvdb::StringMetadata(encodings[static_cast<int>(group.encoding)]));
  grid->insertMeta("solidtex_model", openvdb::StringMetadata(volume.texture.name()));
  grid->insertMeta("solidtex_seed", openvdb::StringMetadata(std::to_string(volume.texture.seed())));
  grid->insertMeta("solidtex_precision", openvdb::StringMetadata(volume.texture.precision()));
  return grid;
}

// Writes the bytes of openvdb::io::File through a stream that reports a full disk, which File does
// not.
class StreamArchive : public openvdb::io::Archive {
 public:
  void write_grids(std::ostream& stream, const openvdb::GridCPtrVec& grids) const {
    Archive::write(stream, grids, /*seekable=*/true);
  }
};

class VdbSink : public Sink {
 public:
  VdbSink(std::filesystem::path path, const Volume& volume)
      : path_(std::move(path)), volume_(volume), groups_(channel_groups(volume.texture)) {
    openvdb::initialize();
    for (const ChannelGroup& group : groups_) grids_.push_back(make_grid(volume, group));
    const double bytes = static_cast<double>(voxel_count(volume.size)) *
                         static_cast<double>(volume.channels() * sizeof(float));
    std::cerr << "The OpenVDB grids take about "
              << static_cast<long long>(bytes * 1.05 / (1 << 20)) + 1
              << " MiB of memory until they are written.\n";
  }

  std::int64_t depth() const override { return volume_.size[2]; }

  void take(const Piece& piece) override {
    for (std::size_t i = 0; i < groups_.size(); ++i) {
      if (groups_[i].channels.size() == 3) {
        fill(*openvdb::gridPtrCast<openvdb::Vec3SGrid>(grids_[i]), volume_, piece, groups_[i]);
      } else {
        fill(*openvdb::gridPtrCast<openvdb::FloatGrid>(grids_[i]), volume_, piece, groups_[i]);
      }
    }
  }

  void finish() override {
    try {
      std::ofstream stream;
      stream.exceptions(std::ios::failbit | std::ios::badbit);
      stream.open(path_, std::ios::binary);
      StreamArchive().write_grids(stream, {grids_.begin(), grids_.end()});
      stream.close();
    } catch (const std::ios_base::failure&) {
      throw WriteError(path_, std::strerror(errno));
    }
  }

 private:
  std::filesystem::path path_;
  Volume volume_;
  std::vector<ChannelGroup> groups_;
  std::vector<openvdb::GridBase::Ptr> grids_;
};

}  // namespace

std::unique_ptr<Sink> make_vdb_sink(const std::filesystem::path& path, const Volume& volume) {
  return std::make_unique<VdbSink>(path, volume);
}

}  // namespace solidtex::tools
