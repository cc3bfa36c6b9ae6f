// OpenVDB and NanoVDB files of a dense volume, or of the voxels in a mask.
#pragma once

#include <openvdb/openvdb.h>

#include "tools/bake/sink.h"

namespace solidtex::tools {

// The voxels to keep, and where the grids lie in the world.
struct VdbMask {
  openvdb::BoolGrid::ConstPtr grid;  // its active voxels, relative to `base`
  openvdb::Coord base;
  openvdb::Vec3d translation;  // of voxel 0's corner

  // Whether a box of voxels, from absolute coordinates, has any of them.
  bool any(const openvdb::CoordBBox& box) const;
  // Bytes of the grids of an output.
  double bytes(const Output& output) const;
};

std::unique_ptr<Sink> make_vdb_sink(const std::filesystem::path& path, const Output& output,
                                    const Volume& volume, const VdbMask& mask);

}  // namespace solidtex::tools
