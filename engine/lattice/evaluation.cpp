#include "engine/lattice/evaluation.h"

#include <sys/mman.h>

#include <algorithm>
#include <cstdlib>
#include <new>

#include "engine/kernels/kernels.h"
#include "engine/lattice/operations.h"
#include "engine/lattice/regions.h"

namespace solidtex::engine {

namespace {

// Voxels per step along x. Plane rings fit in the second-level cache; short steps of small boxes
// cost more. See docs/experiments/engine-constants.md.
constexpr std::int64_t kStepVoxels = 4096, kMinStep = 4, kMaxStep = 8;

std::vector<Box> steps_along_x(const Box& box) {
  std::int64_t length = kMaxStep;
  while (length > kMinStep && length * box.size(1) * box.size(2) > kStepVoxels) length /= 2;
  std::vector<Box> steps;
  for (std::int64_t x = box.lo[0]; x < box.hi[0];) {
    Box step = box;
    step.lo[0] = x;
    step.hi[0] = std::min((x & ~(length - 1)) + length, box.hi[0]);
    x = step.hi[0];
    steps.push_back(step);
  }
  return steps;
}

// In a tile of four every input affects every output, so results need whole tiles. Tiles of two do
// not.
Box whole_tiles(Box box, int tile) {
  if (tile == 4) {
    box.lo[0] &= ~std::int64_t{3};
    box.hi[0] = (box.hi[0] + 3) & ~std::int64_t{3};
  }
  return box;
}

}  // namespace

// A convolution touches one page for each parity of each channel of a plane, more than the
// first-level TLB holds: large pages save a fifth of the time of a large box.
float* Workspace::floats(std::size_t count, ScratchMeter& meter) {
  constexpr std::size_t kPage = std::size_t{1} << 21;
  if (count > size_) {
    const std::size_t bytes = (count * sizeof(float) + kPage - 1) / kPage * kPage;
    meter.remove(size_ * sizeof(float));
    size_ = 0;
    memory_.reset(static_cast<float*>(std::aligned_alloc(kPage, bytes)));
    if (!memory_) throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
    madvise(memory_.get(), bytes, MADV_HUGEPAGE);  // advice only
#endif
    size_ = bytes / sizeof(float);
    meter.add(bytes);
    std::fill_n(memory_.get(), size_, 0.0f);
  }
  return memory_.get();
}

void Evaluation::run(const Box& box, const BoxTarget& target, Workspace& workspace,
                     ScratchMeter& meter) {
  const Box whole = whole_tiles(box, plan_.steps.back().chain.tile());
  const std::vector<Box> steps = steps_along_x(whole);
  find_regions(whole, steps);
  place_rings(workspace, meter);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    for (const Step& step : plan_.steps) advance(step, regions_[i][step.node]);
    Box part = box;
    part.lo[0] = std::max(box.lo[0], steps[i].lo[0]);
    part.hi[0] = std::min(box.hi[0], steps[i].hi[0]);
    BoxTarget rest = target;
    rest.data += (part.lo[0] - box.lo[0]) * target.x_pitch;
    write_output(part, rest);
  }
}

// Along y and z every step uses the regions of the whole box. A reader that needs nothing in one
// step may need these planes in the next: a transposed convolution of kernel 1 reaches every other
// voxel.
void Evaluation::find_regions(const Box& box, const std::vector<Box>& steps) {
  const std::vector<Box> whole = required_regions(model_, box);
  regions_.clear();
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const bool is_last = i + 1 == steps.size();
    regions_.push_back(required_regions(
        model_, steps[i], is_last ? std::span<const int>() : std::span(plan_.tile_origins)));
    for (std::size_t node = 0; node < whole.size(); ++node) {
      Box& region = regions_.back()[node];
      if (region.empty()) continue;
      region.hi[0] = std::min(region.hi[0], whole[node].hi[0]);
      for (const int axis : {1, 2}) {
        region.lo[axis] = whole[node].lo[axis];
        region.hi[axis] = whole[node].hi[axis];
      }
    }
  }
}

void Evaluation::place_rings(Workspace& workspace, ScratchMeter& meter) {
  rings_.assign(model_.nodes.size(), {});
  std::size_t size = 0, scratch = 0;
  std::vector<std::size_t> offsets;
  for (const Step& step : plan_.steps) {
    const Node& node = model_.nodes[step.node];
    Box kept;
    std::int64_t planes = 1;
    for (const auto& regions : regions_) {
      if (regions[step.node].empty()) continue;
      kept = kept_box(step, regions[step.node]);
      planes = std::max(planes, kept.size(0));
    }
    offsets.push_back(size);
    if (kept.empty()) continue;
    rings_[step.node] = PlaneRing(kept, node.channels, is_upsample(step.node) ? 1 : 4, planes);
    size += rings_[step.node].memory();
    if (step.is_chain()) scratch = std::max(scratch, kernels::winograd_scratch(step.chain));
  }
  scratch_ = workspace.floats(scratch + size, meter);
  for (std::size_t i = 0; i < offsets.size(); ++i)
    rings_[plan_.steps[i].node].use(scratch_ + scratch + offsets[i]);
}

// Returns the part of a region that a ring keeps. An upsampled node keeps the coarse voxels.
Box Evaluation::kept_box(const Step& step, const Box& region) const {
  if (is_upsample(step.node)) return required_input(model_.nodes[step.node].op, region);
  return step.is_chain() && !region.empty() ? whole_tiles_across(region, step.chain.origin)
                                            : region;
}

// Computes the planes of a region that the ring does not have yet.
void Evaluation::advance(const Step& step, const Box& region) {
  Box box = kept_box(step, region);
  if (box.empty()) return;
  PlaneRing& ring = rings_[step.node];
  const std::int64_t computed = ring.empty() ? box.lo[0] : ring.planes().x_hi;
  ring.slide(box.lo[0], std::max(box.hi[0], computed));
  box.lo[0] = std::max(box.lo[0], computed);
  if (!box.empty()) compute(step, box);
}

void Evaluation::compute(const Step& step, const Box& box) {
  const Node& node = model_.nodes[step.node];
  const PlaneRing& ring = rings_[step.node];
  if (step.is_chain()) return convolve(step, box);
  if (const auto* noise = std::get_if<NoiseOp>(&node.op))
    return fill_noise({scheme_, seed_, node.level, noise->distribution, period_ >> node.level},
                      ring, box.lo[0], box.hi[0]);
  if (const auto* periodic = std::get_if<PeriodicOp>(&node.op))
    return fill_waves(*periodic, period_ >> node.level, ring, box.lo[0], box.hi[0]);
  is_upsample(step.node) ? copy_coarse(step.node, box) : compute_general(step, box);
}

// Copies the input of an upsampled node, without its parity split.
void Evaluation::copy_coarse(int node, const Box& box) const {
  const int input = model_.nodes[node].inputs[0];
  const std::vector<int>& parts = plan_.parts[input];
  const PlaneRing& ring = rings_[node];
  if (parts.size() == 1 && !is_upsample(parts[0])) return ring.join_planes(rings_[parts[0]], box);
  std::vector<float> row(static_cast<std::size_t>(box.size(2)));
  for (int c = 0; c < model_.nodes[node].channels; ++c)
    for (std::int64_t x = box.lo[0]; x < box.hi[0]; ++x)
      for (std::int64_t y = box.lo[1]; y < box.hi[1]; ++y) {
        read(input, c, x, y, box.lo[2], box.hi[2], row.data());
        ring.write(c, x, y, box.lo[2], box.hi[2], row.data());
      }
}

void Evaluation::convolve(const Step& step, const Box& box) {
  std::vector<ConvSource> sources;
  for (const int part : plan_.parts[model_.nodes[step.first].inputs[0]])
    sources.push_back({rings_[part].planes(), is_upsample(part)});
  kernels::winograd_conv3d(step.chain, sources, tile_range(box, step.chain.origin),
                           rings_[step.node].planes(), scratch_);
}

// Computes any other operation on blocks in plain order.
void Evaluation::compute_general(const Step& step, const Box& box) {
  const Node& node = model_.nodes[step.node];
  const Box needed = required_input(node.op, box);
  const Block in = gather(node.inputs[0], needed);
  const Block out = apply(node, step.layer, in, box);
  const PlaneRing& ring = rings_[step.node];
  for (int c = 0; c < node.channels; ++c)
    for (std::int64_t x = box.lo[0]; x < box.hi[0]; ++x)
      for (std::int64_t y = box.lo[1]; y < box.hi[1]; ++y)
        ring.write(c, x, y, box.lo[2], box.hi[2],
                   out.volume().row(c, x - box.lo[0], y - box.lo[1]));
}

Block Evaluation::gather(int node, const Box& box) const {
  Block block(box, model_.nodes[node].channels);
  for (int c = 0; c < block.volume().channels; ++c)
    for (std::int64_t x = box.lo[0]; x < box.hi[0]; ++x)
      for (std::int64_t y = box.lo[1]; y < box.hi[1]; ++y)
        read(node, c, x, y, box.lo[2], box.hi[2],
             block.volume().row(c, x - box.lo[0], y - box.lo[1]));
  return block;
}

void Evaluation::read(int node, int channel, std::int64_t x, std::int64_t y, std::int64_t z_lo,
                      std::int64_t z_hi, float* values) const {
  for (const int part : plan_.parts[node]) {
    const PlaneRing& ring = rings_[part];
    const int channels = model_.nodes[part].channels;
    if (channel >= channels) {
      channel -= channels;
    } else if (is_upsample(part)) {
      std::vector<float> coarse(static_cast<std::size_t>(((z_hi + 1) >> 1) - (z_lo >> 1)));
      ring.read(channel, x >> 1, y >> 1, z_lo >> 1, (z_hi + 1) >> 1, coarse.data());
      for (std::int64_t z = z_lo; z < z_hi; ++z) values[z - z_lo] = coarse[(z >> 1) - (z_lo >> 1)];
      return;
    } else {
      return ring.read(channel, x, y, z_lo, z_hi, values);
    }
  }
}

void Evaluation::write_output(const Box& box, const BoxTarget& target) const {
  const int output = static_cast<int>(model_.nodes.size()) - 1;
  const int channels = model_.nodes[output].channels;
  const auto length = static_cast<std::size_t>(box.size(2));
  std::vector<float> rows(length * channels);
  for (std::int64_t x = box.lo[0]; x < box.hi[0]; ++x)
    for (std::int64_t y = box.lo[1]; y < box.hi[1]; ++y) {
      for (int c = 0; c < channels; ++c)
        read(output, c, x, y, box.lo[2], box.hi[2], &rows[c * length]);
      float* to = target.data + (x - box.lo[0]) * target.x_pitch + (y - box.lo[1]) * target.y_pitch;
      for (std::size_t z = 0; z < length; ++z)
        for (int c = 0; c < channels; ++c) *to++ = rows[c * length + z];
    }
}

}  // namespace solidtex::engine
