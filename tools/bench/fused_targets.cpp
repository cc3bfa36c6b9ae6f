#include "tools/bench/fused_targets.h"

// As in the library, which has no body for scalable vectors.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tools/bench/fused_targets.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace solidtex::tools::HWY_NAMESPACE {

bool IsFused() { return HWY_NATIVE_FMA; }

}  // namespace solidtex::tools::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace solidtex::tools {

HWY_EXPORT(IsFused);

std::vector<std::string> fused_targets() {
  std::vector<std::string> names;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::GetChosenTarget().Update(target);
    if (HWY_DYNAMIC_DISPATCH(IsFused)()) names.emplace_back(hwy::TargetName(target));
  }
  hwy::GetChosenTarget().DeInit();
  return names;
}

}  // namespace solidtex::tools
#endif
