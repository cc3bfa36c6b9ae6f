#include "tools/bake/vdb_sink.h"

#include <fmt/format.h>

#ifdef SOLIDTEX_HAS_NANOVDB
#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#endif

#include <cerrno>
#include <cstring>
#include <fstream>
#include <optional>
#include <stdexcept>

#include "tools/bake/channels.h"
#include "tools/common/cli.h"
#include "tools/common/limits.h"
#include "tools/common/output_file.h"

namespace solidtex::tools {
namespace {

// Every voxel of the piece, or of the mask, becomes active, zeros too.
template <class Grid>
void fill(Grid& grid, const Volume& volume, const Piece& piece, const VoxelEncoder& encoder,
          const VdbMask* mask) {
  auto accessor = grid.getAccessor();
  std::optional<openvdb::BoolGrid::ConstAccessor> kept;
  if (mask) kept.emplace(mask->grid->getConstAccessor());
  const float* voxel = piece.values.data();
  typename Grid::ValueType value;
  for (std::int64_t x = 0; x < piece.size[0]; ++x) {
    for (std::int64_t y = 0; y < piece.size[1]; ++y) {
      for (std::int64_t z = 0; z < piece.size[2]; ++z, voxel += volume.channels()) {
        const auto index = [&](int axis, std::int64_t step) {
          return static_cast<std::int32_t>(volume.origin[axis] + piece.offset[axis] + step);
        };
        const openvdb::Coord at(index(0, x), index(1, y), index(2, z));
        if (kept && !kept->isValueOn(at - mask->base)) continue;
        encoder.encode(voxel, 0, 1, reinterpret_cast<std::byte*>(&value));
        accessor.setValueOn(at, value);
      }
    }
  }
}

openvdb::GridBase::Ptr make_grid(const Output& output, const Volume& volume,
                                 const ChannelGroup& group, const VdbMask* mask) {
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
  if (mask) transform->postTranslate(mask->translation);
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
  VdbSink(std::filesystem::path path, const Output& output, const Volume& volume,
          const VdbMask* mask)
      : path_(std::move(path)),
        is_nano_(output.format.kind == FormatKind::nanovdb),
        volume_(volume) {
    if (mask) mask_ = *mask;
    openvdb::initialize();
    for (const ChannelGroup& group : output.groups) {
      grids_.push_back(make_grid(output, volume, group, mask));
      // In memory all grids have floats.
      encoders_.emplace_back(output, group.channels, Depth::float32);
    }
    const double dense = static_cast<double>(voxel_count(volume.size)) *
                         static_cast<double>(output.channels.size() * sizeof(float)) * 1.05;
    say(fmt::format("The OpenVDB grids take about {} MiB of memory until they are written.",
                    static_cast<long long>((mask ? mask->bytes(output) : dense) / (1 << 20)) + 1));
  }

  std::int64_t depth() const override { return volume_.size[2]; }

  void take(const Piece& piece) override {
    const VdbMask* mask = mask_ ? &*mask_ : nullptr;
    for (std::size_t i = 0; i < grids_.size(); ++i) {
      if (grids_[i]->isType<openvdb::Vec3SGrid>()) {
        fill(*openvdb::gridPtrCast<openvdb::Vec3SGrid>(grids_[i]), volume_, piece, encoders_[i],
             mask);
      } else {
        fill(*openvdb::gridPtrCast<openvdb::FloatGrid>(grids_[i]), volume_, piece, encoders_[i],
             mask);
      }
    }
  }

  void finish() override {
    try {
      std::ofstream stream;
      stream.exceptions(std::ios::failbit | std::ios::badbit);
      stream.open(path_, std::ios::binary);
      write(stream);
      stream.close();
    } catch (const std::ios_base::failure&) {
      throw WriteError(path_, std::strerror(errno));
    }
  }

 private:
  void write(std::ostream& stream) {
    if (!is_nano_) {
      StreamArchive().write_grids(stream, {grids_.begin(), grids_.end()});
      return;
    }
#ifdef SOLIDTEX_HAS_NANOVDB
    for (openvdb::GridBase::Ptr& grid : grids_) {
      const auto nano = nanovdb::openToNanoVDB(grid);
      grid.reset();
      nanovdb::io::writeGrid(stream, nano);
    }
#endif
  }

  std::filesystem::path path_;
  bool is_nano_;
  Volume volume_;
  std::optional<VdbMask> mask_;
  std::vector<openvdb::GridBase::Ptr> grids_;
  std::vector<VoxelEncoder> encoders_;  // one for each grid
};

}  // namespace

bool VdbMask::any(const openvdb::CoordBBox& box) const {
  const openvdb::Coord min = box.min() - base, max = box.max() - base;
  const auto accessor = grid->getConstAccessor();
  constexpr std::int32_t leaf = 8;
  const auto next = [](std::int32_t i) { return (i & -leaf) + leaf; };  // of the next leaf
  for (std::int32_t x = min[0]; x <= max[0]; x = next(x)) {
    for (std::int32_t y = min[1]; y <= max[1]; y = next(y)) {
      for (std::int32_t z = min[2]; z <= max[2]; z = next(z)) {
        const openvdb::Coord at(x, y, z);
        if (accessor.probeConstLeaf(at) || accessor.isValueOn(at)) return true;
      }
    }
  }
  return false;
}

double VdbMask::bytes(const Output& output) const {
  constexpr double voxels = 8 * 8 * 8, overhead = 128;
  const openvdb::BoolTree& tree = grid->tree();
  const double in_tiles =
      static_cast<double>(tree.activeVoxelCount() - tree.activeLeafVoxelCount());
  const double leaves = static_cast<double>(tree.leafCount()) + in_tiles / voxels;
  return leaves * (voxels * static_cast<double>(output.channels.size() * sizeof(float)) +
                   overhead * static_cast<double>(output.groups.size()));
}

std::unique_ptr<Sink> make_vdb_sink(const std::filesystem::path& path, const Output& output,
                                    const Volume& volume) {
  return std::make_unique<VdbSink>(path, output, volume, nullptr);
}

std::unique_ptr<Sink> make_vdb_sink(const std::filesystem::path& path, const Output& output,
                                    const Volume& volume, const VdbMask& mask) {
  return std::make_unique<VdbSink>(path, output, volume, &mask);
}

}  // namespace solidtex::tools
