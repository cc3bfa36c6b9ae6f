// Runs a check once for each Highway target that this machine has.
#pragma once

#include <hwy/targets.h>

#include "catch.hpp"

namespace testing {

template <class Check>
void on_every_target(Check check) {
  const auto use = [](std::int64_t targets) {
    hwy::SetSupportedTargetsForTest(targets);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  };
  use(0);
  const std::int64_t supported = hwy::SupportedTargets();
  for (std::int64_t rest = supported; rest != 0; rest &= rest - 1) {
    const std::int64_t target = rest & -rest;
    use(target);
    INFO("target " << hwy::TargetName(target));
    check();
  }
  use(0);
}

}  // namespace testing
