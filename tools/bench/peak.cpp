// Arrays of vectors do not work with vectors of unknown length; as in the library.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tools/bench/peak.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace solidtex::tools::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Two units of latency 4 need 8 independent sums. 12 suit faster units too, and fit into 16
// registers together with the factors.
constexpr int kSums = 12;

// Returns the number of operations. `result` keeps them from being optimized away.
double MultiplyAdd(std::int64_t steps, float* result) {
  const hn::ScalableTag<float> d;
  using V = hn::Vec<decltype(d)>;
  const V half = hn::Set(d, 0.5f);  // sum = sum / 2 + 1/2 stays finite and normal
  V sums[kSums];
  for (int i = 0; i < kSums; ++i) sums[i] = hn::Set(d, static_cast<float>(i));
  for (std::int64_t step = 0; step < steps; ++step)
    for (int i = 0; i < kSums; ++i) sums[i] = hn::MulAdd(sums[i], half, half);
  V total = sums[0];
  for (int i = 1; i < kSums; ++i) total = hn::Add(total, sums[i]);
  *result = hn::GetLane(total);
  return 2.0 * static_cast<double>(steps) * kSums * static_cast<double>(hn::Lanes(d));
}

bool HasFusedMultiplyAdd() { return HWY_NATIVE_FMA; }

}  // namespace solidtex::tools::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include <barrier>
#include <thread>
#include <vector>

#include "tools/bench/peak.h"

namespace solidtex::tools {
namespace {

HWY_EXPORT(MultiplyAdd);
HWY_EXPORT(HasFusedMultiplyAdd);

constexpr std::int64_t steps_per_sample = 1'000'000;

}  // namespace

double measure_peak(int threads, Clock clock) {
  std::barrier start(threads);
  std::vector<double> rates(static_cast<std::size_t>(threads));
  const auto work = [&](double& rate) {
    float result = 0;
    start.arrive_and_wait();
    // Each thread is timed by itself: a late one does not slow the others down.
    const Stopwatch stopwatch(clock);
    const double operations = HWY_DYNAMIC_DISPATCH(MultiplyAdd)(steps_per_sample, &result);
    const double seconds = stopwatch.seconds();
    volatile float kept = result;
    static_cast<void>(kept);
    rate = operations / seconds;
  };
  std::vector<std::thread> others;
  for (int i = 1; i < threads; ++i)
    others.emplace_back([&, i] { work(rates[static_cast<std::size_t>(i)]); });
  work(rates[0]);
  for (std::thread& thread : others) thread.join();
  double sum = 0;
  for (const double rate : rates) sum += rate;
  return sum;
}

std::vector<std::string> fused_targets() {
  std::vector<std::string> names;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::GetChosenTarget().Update(target);
    if (HWY_DYNAMIC_DISPATCH(HasFusedMultiplyAdd)()) names.emplace_back(hwy::TargetName(target));
  }
  hwy::GetChosenTarget().DeInit();
  return names;
}

}  // namespace solidtex::tools
#endif
