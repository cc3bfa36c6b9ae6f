#include "tools/bake/mesh_volume.h"

#include <fmt/core.h>
#include <openvdb/tools/LevelSetUtil.h>
#include <openvdb/tools/MeshToVolume.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>

#include "tools/bake/vdb_sink.h"
#include "tools/common/limits.h"
#include "tools/common/progress.h"

namespace solidtex::tools {
namespace {

using mesh::Mesh;

// Numbers of the vertices, where vertices at the same place have the same number.
std::vector<std::uint32_t> places(const Mesh& mesh) {
  std::map<std::array<float, 3>, std::uint32_t> numbers;
  std::vector<std::uint32_t> result;
  for (const glm::vec3& p : mesh.positions) {
    const auto next = static_cast<std::uint32_t>(numbers.size());
    result.push_back(numbers.try_emplace({p.x + 0.0f, p.y + 0.0f, p.z + 0.0f}, next).first->second);
  }
  return result;
}

// In a closed mesh each edge belongs to an even number of triangles.
void check_closed(const Mesh& mesh) {
  const std::vector<std::uint32_t> vertices = places(mesh);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const glm::uvec3& triangle : mesh.triangles) {
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t a = vertices[triangle[i]], b = vertices[triangle[(i + 1) % 3]];
      if (a != b) edges.push_back(std::minmax(a, b));
    }
  }
  std::ranges::sort(edges);
  std::size_t open = 0;
  for (std::size_t first = 0, last = 0; first < edges.size(); first = last) {
    while (last < edges.size() && edges[last] == edges[first]) ++last;
    open += (last - first) % 2;
  }
  if (open == 0) return;
  throw std::runtime_error(fmt::format(
      "{}: found {} open edges, expected a closed mesh with --to volume; close its holes, or bake "
      "its surface with --to uv",
      mesh.file, open));
}

double surface_area(const Mesh& mesh) {
  double area = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 a(mesh.positions[t.x]), b(mesh.positions[t.y]), c(mesh.positions[t.z]);
    area += 0.5 * glm::length(glm::cross(b - a, c - a));
  }
  return area;
}

openvdb::Coord base_of(const mesh::Placement& placement) {
  openvdb::Coord base;
  for (int axis = 0; axis < 3; ++axis)
    base[axis] =
        static_cast<std::int32_t>(std::floor(placement.origin[static_cast<std::size_t>(axis)]));
  return base;
}

// Voxels relative to `base`; voxel i has its center at i + 0.5.
openvdb::BoolGrid::Ptr inside_of(const Mesh& mesh, const mesh::Placement& placement,
                                 const openvdb::Coord& base) {
  std::vector<openvdb::Vec3s> points;
  for (const glm::vec3& position : mesh.positions) {
    openvdb::Vec3d texel;
    for (int axis = 0; axis < 3; ++axis)
      texel[axis] = placement.origin[static_cast<std::size_t>(axis)] - base[axis] - 0.5 +
                    placement.texels_per_unit * static_cast<double>(position[axis]);
    points.emplace_back(texel);
  }
  std::vector<openvdb::Vec3I> triangles;
  for (const glm::uvec3& triangle : mesh.triangles)
    triangles.emplace_back(triangle.x, triangle.y, triangle.z);
  const auto distance = openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(
      *openvdb::math::Transform::createLinearTransform(1.0), points, triangles, 1.5f);
  return openvdb::tools::sdfInteriorMask(*distance);
}

// OpenVDB counts voxels in 32 bits, and a mesh with its distances must fit into memory.
void check_extent(const Output& output, const Mesh& mesh, const mesh::Placement& placement) {
  constexpr double max_texel = 1 << 30, bytes_per_texel_of_surface = 200;
  for (const glm::vec3& position : mesh.positions) {
    for (int axis = 0; axis < 3; ++axis) {
      const double texel = placement.origin[static_cast<std::size_t>(axis)] +
                           placement.texels_per_unit * static_cast<double>(position[axis]);
      if (std::abs(texel) < max_texel) continue;
      throw std::runtime_error(
          fmt::format("{}: found a vertex at texel {:.6g}, expected less than 2^30; give a smaller "
                      "--texels-per-unit or --origin",
                      mesh.file, texel));
    }
  }
  const double tpu = placement.texels_per_unit;
  check_memory(output.path.string(), surface_area(mesh) * tpu * tpu * bytes_per_texel_of_surface,
               "a smaller --texels-per-unit needs less");
}

}  // namespace

void bake_inside(const Output& output, const Mesh& mesh, const mesh::Placement& placement,
                 const solidtex::texture& texture, const std::filesystem::path& file) {
  openvdb::initialize();
  check_closed(mesh);
  check_extent(output, mesh, placement);
  VdbMask mask{nullptr, base_of(placement), {}};
  mask.grid = inside_of(mesh, placement, mask.base);
  if (mask.grid->activeVoxelCount() == 0) {
    throw std::runtime_error(mesh.file +
                             ": found no voxel inside; give a larger --texels-per-unit");
  }
  for (int axis = 0; axis < 3; ++axis)
    mask.translation[axis] = mesh.origin[axis] - placement.origin[static_cast<std::size_t>(axis)] /
                                                     placement.texels_per_unit;
  check_memory(output.path.string(),
               mask.bytes(output) * (output.format.kind == FormatKind::vdb ? 1 : 2),
               "a smaller --texels-per-unit needs less");

  Output scaled = output;
  scaled.voxel_size.edges.fill(1 / placement.texels_per_unit);
  const openvdb::CoordBBox box = mask.grid->evalActiveVoxelBoundingBox();
  Volume volume{texture, {}, {}};
  for (int axis = 0; axis < 3; ++axis) {
    volume.origin[static_cast<std::size_t>(axis)] = std::int64_t{mask.base[axis]} + box.min()[axis];
    volume.size[static_cast<std::size_t>(axis)] = box.dim()[axis];
  }
  Progress progress("Baking " + texture.name(), voxel_count(volume.size));
  const auto sink = make_vdb_sink(file, scaled, volume, mask);
  const auto is_wanted = [&](const Index3& offset, const Index3& size) {
    openvdb::Coord min, max;
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      min[axis] = static_cast<std::int32_t>(volume.origin[i] + offset[i]);
      max[axis] = static_cast<std::int32_t>(volume.origin[i] + offset[i] + size[i] - 1);
    }
    return mask.any({min, max});
  };
  constexpr std::int64_t block = 64;
  for_each_piece(
      volume, {block, block, block}, progress, [&](const Piece& piece) { sink->take(piece); },
      is_wanted);
  sink->finish();
  progress.finish();
}

}  // namespace solidtex::tools
