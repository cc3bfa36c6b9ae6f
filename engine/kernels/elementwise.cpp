// Element-wise kernels on the active target. See kernels.h.
#include "engine/kernels/targets.h"
// foreach_target.h includes this file once per target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/kernels/elementwise.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "engine/kernels/kernels.h"
#include "engine/kernels/math.h"
#include "engine/kernels/vector-inl.h"

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

#if SOLIDTEX_VECTOR_KERNELS

// out = function(channel, in), row by row.
template <class Function>
HWY_INLINE void Map(const ConstVolume& in, const Volume& out, Function function) {
  for (int c = 0; c < out.channels; ++c)
    for (std::int64_t x = 0; x < out.size[0]; ++x)
      for (std::int64_t y = 0; y < out.size[1]; ++y) {
        const float* from = in.row(c, x, y);
        float* to = out.row(c, x, y);
        for (std::ptrdiff_t z = 0; z < out.size[2]; z += FloatLanes())
          StoreFirst(function(c, hn::LoadU(Float(), from + z)), to + z, out.size[2] - z);
      }
}

// exp(-v) for v >= 0.
HWY_INLINE Floats ExpNegative(Floats v) {
  const Float d;
  const Int di;
  const Floats limit = hn::Set(d, kExpLimit), shift = hn::Set(d, kRoundingShift);
  const Floats x = hn::Neg(hn::IfThenElse(hn::Lt(v, limit), v, limit));
  const Floats n = hn::Sub(FusedMulAdd(x, hn::Set(d, kLog2E), shift), shift);
  const Floats r = FusedMulAdd(n, hn::Set(d, -kLog2Low), FusedMulAdd(n, hn::Set(d, -kLog2High), x));
  const Floats e = hn::Add(hn::Set(d, 1.0f), FusedMulAdd(Polynomial(kExp, r), hn::Mul(r, r), r));
  const Ints power = hn::ShiftLeft<23>(hn::Add(hn::ConvertTo(di, n), hn::Set(di, 127)));
  return hn::Mul(e, hn::BitCast(d, power));
}

void Affine(const float* scale, const float* shift, const ConstVolume& in, const Volume& out) {
  Map(in, out, [&](int c, Floats v) {
    return FusedMulAdd(hn::Set(Float(), scale[c]), v, hn::Set(Float(), shift[c]));
  });
}

void LeakyRelu(float negative_slope, const ConstVolume& in, const Volume& out) {
  Map(in, out, [&](int, Floats v) {
    const Float d;
    return hn::IfThenElse(hn::Gt(v, hn::Zero(d)), v, hn::Mul(hn::Set(d, negative_slope), v));
  });
}

void Tanh(const ConstVolume& in, const Volume& out) {
  Map(in, out, [](int, Floats x) {
    const Float d;
    const Floats one = hn::Set(d, 1.0f), v = hn::Abs(x), square = hn::Mul(v, v);
    const Floats e = ExpNegative(hn::Add(v, v));
    const Floats far = hn::Div(hn::Sub(one, e), hn::Add(one, e));
    const Floats near = FusedMulAdd(hn::Mul(Polynomial(kTanh, square), square), v, v);
    return hn::CopySign(hn::IfThenElse(hn::Lt(v, hn::Set(d, kTanhSwitch)), near, far), x);
  });
}

void Sigmoid(const ConstVolume& in, const Volume& out) {
  Map(in, out, [](int, Floats x) {
    const Float d;
    const Floats one = hn::Set(d, 1.0f), e = ExpNegative(hn::Abs(x));
    return hn::Div(hn::IfThenElse(hn::Gt(x, hn::Zero(d)), one, e), hn::Add(one, e));
  });
}

void Softmax(const ConstVolume& in, const Volume& out) {
  for (std::int64_t x = 0; x < out.size[0]; ++x)
    for (std::int64_t y = 0; y < out.size[1]; ++y)
      for (std::ptrdiff_t z = 0; z < out.size[2]; z += FloatLanes()) {
        const auto input = [&](int c) { return hn::LoadU(Float(), in.row(c, x, y) + z); };
        Floats most = input(0), sum = hn::Zero(Float());
        for (int c = 1; c < in.channels; ++c)
          most = hn::IfThenElse(hn::Lt(most, input(c)), input(c), most);
        for (int c = 0; c < in.channels; ++c)
          sum = hn::Add(sum, ExpNegative(hn::Sub(most, input(c))));
        for (int c = 0; c < in.channels; ++c)
          StoreFirst(hn::Div(ExpNegative(hn::Sub(most, input(c))), sum), out.row(c, x, y) + z,
                     out.size[2] - z);
      }
}

#else

void Affine(const float* scale, const float* shift, const ConstVolume& in, const Volume& out) {
  reference::affine(scale, shift, in, out);
}
void LeakyRelu(float negative_slope, const ConstVolume& in, const Volume& out) {
  reference::leaky_relu(negative_slope, in, out);
}
void Tanh(const ConstVolume& in, const Volume& out) { reference::tanh(in, out); }
void Sigmoid(const ConstVolume& in, const Volume& out) { reference::sigmoid(in, out); }
void Softmax(const ConstVolume& in, const Volume& out) { reference::softmax(in, out); }

#endif

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace solidtex::engine::kernels {

HWY_EXPORT(Affine);
HWY_EXPORT(LeakyRelu);
HWY_EXPORT(Tanh);
HWY_EXPORT(Sigmoid);
HWY_EXPORT(Softmax);

void affine(const float* scale, const float* shift, const ConstVolume& in, const Volume& out) {
  HWY_DYNAMIC_DISPATCH(Affine)(scale, shift, in, out);
}
void leaky_relu(float negative_slope, const ConstVolume& in, const Volume& out) {
  HWY_DYNAMIC_DISPATCH(LeakyRelu)(negative_slope, in, out);
}
void tanh(const ConstVolume& in, const Volume& out) { HWY_DYNAMIC_DISPATCH(Tanh)(in, out); }
void sigmoid(const ConstVolume& in, const Volume& out) { HWY_DYNAMIC_DISPATCH(Sigmoid)(in, out); }
void softmax(const ConstVolume& in, const Volume& out) { HWY_DYNAMIC_DISPATCH(Softmax)(in, out); }

}  // namespace solidtex::engine::kernels
#endif
