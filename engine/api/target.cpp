#include "engine/api/handle.h"
#include "engine/kernels/targets.h"
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/api/target.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <cstdlib>
#include <string>
#include <string_view>

#include "engine/common/error.h"

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

const char* Name() { return hwy::TargetName(HWY_TARGET); }

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace solidtex::engine {
namespace {

HWY_EXPORT(Name);

// Highway gives better targets lower bits. Not by DisableTargets: SupportedTargets, whoever calls
// it later, then chooses among all that the processor has, whatever is disabled.
void keep_to(std::int64_t targets) {
  hwy::SetSupportedTargetsForTest(targets);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

bool limit_to(std::string_view wanted) {
  std::string known;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const char* name = hwy::TargetName(target);
    if (name == wanted) {
      keep_to(hwy::SupportedTargets() & ~(target - 1));
      return true;
    }
    known += (known.empty() ? "" : ", ") + std::string(name);
  }
  throw Error(SOLIDTEX_INVALID_ARGUMENT, "environment variable SOLIDTEX_TARGET is \"" +
                                             std::string(wanted) +
                                             "\", expected one that this machine has: " + known);
}

}  // namespace

void limit_target() {
  // Read once; again only after it was refused.
  [[maybe_unused]] static const bool limited = [] {
    const char* wanted = std::getenv("SOLIDTEX_TARGET");
    return wanted != nullptr && *wanted != '\0' && limit_to(wanted);
  }();
}

const char* target_name() { return HWY_DYNAMIC_DISPATCH(Name)(); }

}  // namespace solidtex::engine
#endif
