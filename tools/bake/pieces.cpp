#include "tools/bake/pieces.h"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <vector>

#include "tools/bake/channels.h"
#include "tools/common/cli.h"

namespace solidtex::tools {
namespace {

constexpr std::int64_t brick = 16;  // edges are whole bricks where that is possible
constexpr std::int64_t max_depth = 1024, max_cross_section = 1 << 16;
constexpr double seconds_between_checks = 1;

// Whole bricks, at least one.
std::int64_t in_bricks(std::int64_t edge) {
  return std::max(edge / brick, std::int64_t{1}) * brick;
}

// The end of a piece of up to `edge` voxels that begins at `offset`: an absolute multiple of
// `unit`, or the end of the volume.
std::int64_t piece_end(const Volume& volume, int axis, std::int64_t offset, std::int64_t edge,
                       std::int64_t unit) {
  if (volume.size[axis] - offset <= edge) return volume.size[axis];
  const std::int64_t beyond = volume.origin[axis] + offset + edge;
  const std::int64_t remainder = (beyond % unit + unit) % unit;
  return offset + edge - remainder;
}

// Chooses the number of planes along x to evaluate at a time, so that Ctrl-C is seen each second.
class Pace {
 public:
  explicit Pace(std::int64_t max_planes) : max_planes_(max_planes) {}

  std::int64_t planes(std::int64_t cross_section) const {
    const double wanted =
        voxels_per_second_ * seconds_between_checks / static_cast<double>(cross_section);
    const double bounded = std::min(wanted, static_cast<double>(max_planes_));
    return std::min(in_bricks(static_cast<std::int64_t>(bounded)), max_planes_);
  }

  void evaluated(std::size_t voxels, double seconds) {
    voxels_per_second_ = static_cast<double>(voxels) / std::max(seconds, 1e-9);
  }

 private:
  std::int64_t max_planes_;
  double voxels_per_second_ = 0;  // unknown at first
};

// The pieces with a given range of y and z, along x.
class Column {
 public:
  Column(const Volume& volume, std::int64_t max_planes, Progress& progress,
         const std::function<void(const Piece&)>& take, const IsWanted& is_wanted)
      : volume_(volume),
        pace_(max_planes),
        progress_(progress),
        take_(take),
        is_wanted_(is_wanted) {}

  void bake(Piece piece) {
    for (std::int64_t& x = piece.offset[0]; x < volume_.size[0]; x += piece.size[0]) {
      throw_if_interrupted();
      const std::int64_t planes = pace_.planes(piece.size[1] * piece.size[2]);
      piece.size[0] = piece_end(volume_, 0, x, planes, std::min(planes, brick)) - x;
      if (!is_wanted_ || is_wanted_(piece.offset, piece.size)) {
        evaluate(piece);
        take_(piece);
      }
      progress_.advance(voxel_count(piece.size));
    }
  }

 private:
  void evaluate(Piece& piece) {
    const auto start = std::chrono::steady_clock::now();
    tools::evaluate(volume_, piece.offset, piece.size, values_);
    piece.values = values_;
    const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - start;
    pace_.evaluated(voxel_count(piece.size), passed.count());
  }

  const Volume& volume_;
  Pace pace_;
  Progress& progress_;
  const std::function<void(const Piece&)>& take_;
  const IsWanted& is_wanted_;
  std::vector<float> values_;
};

}  // namespace

void evaluate(const Volume& volume, const Index3& offset, const Index3& size,
              std::vector<float>& values) {
  values.resize(voxel_count(size) * volume.channels());
  Index3 origin{};
  for (std::size_t axis = 0; axis < 3; ++axis) origin[axis] = volume.origin[axis] + offset[axis];
  volume.texture.eval_box(origin, size, values);
  check_values(volume.texture, values);
}

Index3 choose_piece(const Volume& volume, std::int64_t depth) {
  const std::int64_t z = std::min({depth, volume.size[2], max_depth});
  const std::int64_t y = in_bricks(max_cross_section / z);
  const auto plane_bytes = std::min(y, volume.size[1]) * z *
                           static_cast<std::int64_t>(volume.channels() * sizeof(float));
  return {in_bricks(max_piece_bytes / plane_bytes), y, z};
}

void check_range(const Volume& volume) {
  constexpr std::int64_t reach = (std::int64_t{1} << 30) + (1 << 16);  // of solidtex_texture
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t first = volume.origin[axis], size = volume.size[axis];
    if (first >= -reach && first <= reach - size) continue;
    throw std::runtime_error(
        fmt::format("--origin: found {} along {} with --size {}, expected voxels from {} to {}",
                    first, "xyz"[axis], size, -reach, reach - 1));
  }
}

void for_each_piece(const Volume& volume, const Index3& largest, Progress& progress,
                    const std::function<void(const Piece&)>& take, const IsWanted& is_wanted) {
  Column column(volume, largest[0], progress, take, is_wanted);
  Piece piece{};
  for (std::int64_t& z = piece.offset[2]; z < volume.size[2]; z += piece.size[2]) {
    piece.size[2] = piece_end(volume, 2, z, largest[2], largest[2]) - z;
    piece.offset[1] = 0;
    for (std::int64_t& y = piece.offset[1]; y < volume.size[1]; y += piece.size[1]) {
      piece.size[1] = piece_end(volume, 1, y, largest[1], largest[1]) - y;
      column.bake(piece);
    }
  }
}

}  // namespace solidtex::tools
