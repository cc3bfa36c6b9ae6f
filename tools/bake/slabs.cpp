#include "tools/bake/slabs.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <vector>

#include "tools/common/cli.h"

namespace solidtex::tools {
namespace {

constexpr std::int64_t max_block = 64, min_block = 16;
constexpr double max_slab_bytes = 1 << 30;

std::int64_t blocks_along(std::int64_t size, std::int64_t block) {
  return (size + block - 1) / block;
}

double slab_bytes(const Volume& volume, int axis, std::int64_t block) {
  double values = static_cast<double>(volume.channels());
  for (int i = 0; i < 3; ++i)
    values *= static_cast<double>(i == axis ? std::min(block, volume.size[i]) : volume.size[i]);
  return values * sizeof(float);
}

// Evaluates one block on this thread alone and copies it to its place in the slab.
void bake_block(const Volume& volume, const Slab& slab, const Index3& at, const Index3& size,
                float* slab_values) {
  const std::size_t channels = volume.channels();
  Index3 origin;
  for (int i = 0; i < 3; ++i) origin[i] = volume.origin[i] + slab.offset[i] + at[i];
  std::vector<float> values(voxel_count(size) * channels);
  // The blocks are what runs in parallel; the engine should not split them further.
  tbb::task_arena(1).execute([&] { volume.texture.eval_box(origin, size, values); });
  const std::size_t row = static_cast<std::size_t>(size[2]) * channels;
  const float* from = values.data();
  for (std::int64_t x = 0; x < size[0]; ++x) {
    for (std::int64_t y = 0; y < size[1]; ++y, from += row) {
      const std::int64_t voxel = ((at[0] + x) * slab.size[1] + at[1] + y) * slab.size[2] + at[2];
      std::copy_n(from, row, slab_values + static_cast<std::size_t>(voxel) * channels);
    }
  }
}

void bake_slab(const Volume& volume, const Slab& slab, std::int64_t block, Progress& progress,
               float* slab_values) {
  Index3 count;
  for (int i = 0; i < 3; ++i) count[i] = blocks_along(slab.size[i], block);
  tbb::parallel_for(std::int64_t{0}, count[0] * count[1] * count[2], [&](std::int64_t index) {
    throw_if_interrupted();
    Index3 at, size;
    for (int i = 2; i >= 0; --i) {
      at[i] = index % count[i] * block;
      size[i] = std::min(block, slab.size[i] - at[i]);
      index /= count[i];
    }
    bake_block(volume, slab, at, size, slab_values);
    progress.advance(voxel_count(size));
  });
}

}  // namespace

std::int64_t choose_block(const Volume& volume, int axis, int threads) {
  const auto blocks = [&](std::int64_t edge) {
    return blocks_along(volume.size[0], edge) * blocks_along(volume.size[1], edge) *
           blocks_along(volume.size[2], edge);
  };
  std::int64_t block = max_block;
  while (block > min_block &&
         (slab_bytes(volume, axis, block) > max_slab_bytes || blocks(block) < 2 * threads))
    block /= 2;
  return block;
}

void for_each_slab(const Volume& volume, int axis, std::int64_t block, Progress& progress,
                   const std::function<void(const Slab&)>& take) {
  std::vector<float> values;
  for (std::int64_t at = 0; at < volume.size[axis]; at += block) {
    Slab slab{{0, 0, 0}, volume.size, {}};
    slab.offset[axis] = at;
    slab.size[axis] = std::min(block, volume.size[axis] - at);
    values.resize(voxel_count(slab.size) * volume.channels());
    slab.values = values;
    bake_slab(volume, slab, block, progress, values.data());
    throw_if_interrupted();
    take(slab);
  }
}

}  // namespace solidtex::tools
