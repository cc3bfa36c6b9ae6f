// The environment variable SOLIDTEX_TARGET.
#include "engine/kernels/targets.h"
// After the choice of targets.
#include <hwy/targets.h>

#include <cstdlib>
#include <string>
#include <string_view>

#include "engine/api/handle.h"

namespace solidtex::engine {
namespace {

// Highway's SupportedTargets makes all targets available again. So it is called before they are
// restricted, and nowhere else in the engine.
void disable(std::int64_t targets) {
  hwy::DisableTargets(targets);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

bool limit_to(std::string_view wanted) {
  std::string known;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const char* name = hwy::TargetName(target);
    if (name == wanted) {
      disable(target - 1);  // better targets have lower bits
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
  // Read once, and again after a refusal.
  [[maybe_unused]] static const bool limited = [] {
    const char* wanted = std::getenv("SOLIDTEX_TARGET");
    return wanted != nullptr && *wanted != '\0' && limit_to(wanted);
  }();
}

const char* target_name() { return hwy::TargetName(kernels::active_target()); }

}  // namespace solidtex::engine
