#include "tools/bench/fused_targets.h"

#include "tools/bench/targets.h"
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
