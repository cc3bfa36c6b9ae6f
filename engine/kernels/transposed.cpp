// Transposed convolutions on the active target. See kernels.h.
#include "engine/kernels/targets.h"
// foreach_target.h includes this file once per target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/kernels/transposed.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <vector>

#include "engine/kernels/kernels.h"
#include "engine/kernels/linear-inl.h"
#include "engine/kernels/parity_split.h"

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

#if SOLIDTEX_VECTOR_KERNELS

// Evaluates a plain convolution for each parity of the output and writes its rows with stride 2.
void ConvTranspose3d(const LinearLayer& layer, const TransposedShape& shape, const ConstVolume& in,
                     const Volume& out) {
  for (const ParityClass& parity : split_by_parity(layer, shape, in, out)) {
    const auto count = static_cast<std::ptrdiff_t>(parity.count[2]);
    std::vector<float> rows(static_cast<std::size_t>(layer.outputs * count));
    const Run run{parity.layer, parity.offsets.data(), count};
    for (std::int64_t x = 0; x < parity.count[0]; ++x)
      for (std::int64_t y = 0; y < parity.count[1]; ++y) {
        EvaluateRun(run, parity.input + x * in.plane_pitch + y * in.row_pitch, rows.data(), count);
        for (int o = 0; o < layer.outputs; ++o) {
          float* to =
              out.row(o, parity.first[0] + 2 * x, parity.first[1] + 2 * y) + parity.first[2];
          for (std::ptrdiff_t z = 0; z < count; ++z) to[2 * z] = rows[o * count + z];
        }
      }
  }
}

#else

void ConvTranspose3d(const LinearLayer& layer, const TransposedShape& shape, const ConstVolume& in,
                     const Volume& out) {
  reference::conv_transpose3d(layer, shape, in, out);
}

#endif

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace solidtex::engine::kernels {

HWY_EXPORT(ConvTranspose3d);

void conv_transpose3d(const LinearLayer& layer, const TransposedShape& shape, const ConstVolume& in,
                      const Volume& out) {
  HWY_DYNAMIC_DISPATCH(ConvTranspose3d)(layer, shape, in, out);
}

}  // namespace solidtex::engine::kernels
#endif
