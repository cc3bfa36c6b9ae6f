// dump_vdb FILE.vdb: one JSON line about every grid, then its voxels as float32,
// [x][y][z][channel].
#include <openvdb/openvdb.h>

#include <cstdio>
#include <exception>

namespace {

template <class Grid>
void dump(const Grid& grid) {
  const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  const openvdb::Coord lo = box.min(), size = box.dim();
  const openvdb::Vec3d center = grid.indexToWorld(lo);
  std::printf(
      "{\"name\": \"%s\", \"origin\": [%d, %d, %d], \"size\": [%d, %d, %d], \"active\": %llu, "
      "\"channels\": %zu, \"world\": [%g, %g, %g]}\n",
      grid.getName().c_str(), lo[0], lo[1], lo[2], size[0], size[1], size[2],
      static_cast<unsigned long long>(grid.activeVoxelCount()),
      sizeof(typename Grid::ValueType) / sizeof(float), center[0], center[1], center[2]);
  const auto accessor = grid.getConstAccessor();
  for (int x = lo[0]; x < lo[0] + size[0]; ++x) {
    for (int y = lo[1]; y < lo[1] + size[1]; ++y) {
      for (int z = lo[2]; z < lo[2] + size[2]; ++z) {
        const typename Grid::ValueType value = accessor.getValue({x, y, z});
        std::fwrite(&value, sizeof value, 1, stdout);
      }
    }
  }
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 2) return 2;
  openvdb::initialize();
  openvdb::io::File file(argv[1]);
  file.open();
  const openvdb::GridPtrVecPtr grids = file.getGrids();
  for (const openvdb::GridBase::Ptr& grid : *grids) {
    if (grid->isType<openvdb::Vec3SGrid>()) {
      dump(*openvdb::gridPtrCast<openvdb::Vec3SGrid>(grid));
    } else {
      dump(*openvdb::gridPtrCast<openvdb::FloatGrid>(grid));
    }
  }
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
