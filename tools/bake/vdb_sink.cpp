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

// Every voxel of the piece becomes active, zeros too: the volume is dense.
template <class Grid>
void fill(Grid& grid, const Volume& volume, const Piece& piece, const VoxelEncoder& encoder) {
  auto accessor = grid.getAccessor();
  const float* voxel = piece.values.data();
  typename Grid::ValueType value;
  for (std::int64_t x = 0; x < piece.size[0]; ++x) {
    for (std::int64_t y = 0; y < piece.size[1]; ++y) {
      for (std::int64_t z = 0; z < piece.size[2]; ++z, voxel += volume.channels()) {
        const auto index = [&](int axis, std::int64_t step) {
          return static_cast<std::int32_t>(volume.origin[axis] + piece.offset[axis] + step);
        };
        encoder.encode(voxel, 0, 1, reinterpret_cast<std::byte*>(&value));
        accessor.setValueOn({index(0, x), index(1, y), index(2, z)}, value);
      }
    }
  }
}

openvdb::GridBase::Ptr make_grid(const Output& output, const Volume& volume,
                                 const ChannelGroup& group) {
  openvdb::GridBase::Ptr grid;
  if (group.channels.size() == 3) {
    grid = openvdb::Vec3SGrid::create();
  } else {
    grid = openvdb::FloatGrid::create();
  }
  grid->setName(group.name);
  // Voxel i is sampled at its center, i + 0.5.
  const openvdb::Vec3d edges(output.voxel_size.edges.data());
  const auto transform = openvdb::math::Transform::createLinearTransform(1.0);
  transform->postScale(edges);
  transform->postTranslate(0.5 * edges);
  grid->setTransform(transform);
  grid->setSaveFloatAsHalf(output.depth == Depth::half);
  grid->insertMeta("solidtex_encoding",
                   openvdb::StringMetadata(encoding_name(output.encoding(group))));
  if (!output.voxel_size.unit.empty())
    grid->insertMeta("solidtex_unit", openvdb::StringMetadata(output.voxel_size.unit));
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
  VdbSink(std::filesystem::path path, const Output& output, const Volume& volume)
      : path_(std::move(path)), volume_(volume) {
    openvdb::initialize();
    for (const ChannelGroup& group : output.groups) {
      grids_.push_back(make_grid(output, volume, group));
      // In memory all grids have floats.
      encoders_.emplace_back(output, group.channels, Depth::float32);
    }
    const double bytes = static_cast<double>(voxel_count(volume.size)) *
                         static_cast<double>(output.channels.size() * sizeof(float));
    std::cerr << "The OpenVDB grids take about "
              << static_cast<long long>(bytes * 1.05 / (1 << 20)) + 1
              << " MiB of memory until they are written.\n";
  }

  std::int64_t depth() const override { return volume_.size[2]; }

  void take(const Piece& piece) override {
    for (std::size_t i = 0; i < grids_.size(); ++i) {
      if (grids_[i]->isType<openvdb::Vec3SGrid>()) {
        fill(*openvdb::gridPtrCast<openvdb::Vec3SGrid>(grids_[i]), volume_, piece, encoders_[i]);
      } else {
        fill(*openvdb::gridPtrCast<openvdb::FloatGrid>(grids_[i]), volume_, piece, encoders_[i]);
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
  std::vector<openvdb::GridBase::Ptr> grids_;
  std::vector<VoxelEncoder> encoders_;  // one for each grid
};

}  // namespace

std::unique_ptr<Sink> make_vdb_sink(const std::filesystem::path& path, const Output& output,
                                    const Volume& volume) {
  return std::make_unique<VdbSink>(path, output, volume);
}

}  // namespace solidtex::tools
