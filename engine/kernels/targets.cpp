#include "engine/kernels/targets.h"
// foreach_target.h includes this file once per target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/kernels/targets.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

std::int64_t Target() { return HWY_TARGET; }

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace solidtex::engine::kernels {

HWY_EXPORT(Target);

std::int64_t active_target() { return HWY_DYNAMIC_DISPATCH(Target)(); }

}  // namespace solidtex::engine::kernels
#endif
