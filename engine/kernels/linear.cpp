// Convolutions on the active target. See kernels.h.
#include "engine/kernels/targets.h"
// foreach_target.h includes this file once per target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/kernels/linear.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <vector>

#include "engine/kernels/kernels.h"
#include "engine/kernels/linear-inl.h"

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

#if SOLIDTEX_VECTOR_KERNELS

// Calls visit(x, y, count) for runs along z that cover the output. If in and out have the same row
// pitch a run is a whole plane; what it writes between rows is undefined.
template <class Visit>
void ForEachRun(const ConstVolume& in, const Volume& out, Visit visit) {
  const bool planes = in.row_pitch == out.row_pitch;
  for (std::int64_t x = 0; x < out.size[0]; ++x) {
    if (planes) {
      visit(x, 0, (out.size[1] - 1) * out.row_pitch + out.size[2]);
    } else {
      for (std::int64_t y = 0; y < out.size[1]; ++y) visit(x, y, out.size[2]);
    }
  }
}

void Conv3d(const LinearLayer& layer, int kernel, const ConstVolume& in, const Volume& out) {
  std::vector<std::ptrdiff_t> offsets;
  for (int c = 0; c < in.channels; ++c)
    for (int kx = 0; kx < kernel; ++kx)
      for (int ky = 0; ky < kernel; ++ky)
        for (int kz = 0; kz < kernel; ++kz) offsets.push_back(in.row(c, kx, ky) + kz - in.data);
  const Run run{layer, offsets.data(), out.channel_pitch};
  ForEachRun(in, out, [&](std::int64_t x, std::int64_t y, std::ptrdiff_t count) {
    EvaluateRun(run, in.row(0, x, y), out.row(0, x, y), count);
  });
}

#else

void Conv3d(const LinearLayer& layer, int kernel, const ConstVolume& in, const Volume& out) {
  reference::conv3d(layer, kernel, in, out);
}

#endif

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace solidtex::engine::kernels {

HWY_EXPORT(Conv3d);

void conv3d(const LinearLayer& layer, int kernel, const ConstVolume& in, const Volume& out) {
  HWY_DYNAMIC_DISPATCH(Conv3d)(layer, kernel, in, out);
}

}  // namespace solidtex::engine::kernels
#endif
