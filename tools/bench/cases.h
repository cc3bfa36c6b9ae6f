// Named cases: their calls and the timing of one call.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <solidtex/solidtex.hpp>
#include <string>
#include <vector>

#include "tools/bench/arena.h"

namespace solidtex::tools {

struct Timing {
  double seconds = 0;                     // of one call
  std::uint64_t peak_resident_bytes = 0;  // where the case measures memory
};

struct Case {
  std::string unit;  // "voxel", "point", "value"
  double units_per_call = 1;
  double multiply_adds_per_unit = 0;  // of direct convolution; 0 where there is nothing to count
  std::function<Timing(Arena&, Clock)> time_call;  // of one call, or the mean of many short ones
};

struct CaseSettings {
  std::string lattice_model = "granite-grey", sampler_model = "stone-grey";
  std::int64_t bake_size = 256;
  bool quick = false;  // tiny sizes and one call, to test that a case runs
};

// Opens each model when the first case needs it, and checks its family.
class Models {
 public:
  explicit Models(const CaseSettings& settings) : settings_(settings) {}
  const solidtex::texture& lattice();
  const solidtex::texture& sampler();
  const solidtex::texture& fast_sampler();

 private:
  const CaseSettings& settings_;
  std::optional<solidtex::texture> lattice_, sampler_, fast_sampler_;
};

struct CaseInfo {
  std::string name, about;
  bool parallel = false;  // runs on all threads; the others on one
  bool usual = true;      // part of a run that names no case
  bool once = false;      // too long to repeat
  std::function<Case(Models&, const CaseSettings&)> make;
};

std::vector<CaseInfo> lattice_cases();
std::vector<CaseInfo> sampler_cases();
std::vector<CaseInfo> noise_cases();
std::vector<CaseInfo> bake_cases();

std::vector<CaseInfo> all_cases();

// Returns the cases that match any of the names or globs, or the usual cases without patterns, in
// the order of all_cases(). A leading "field." is an alias of "lattice.". Throws
// std::invalid_argument if a pattern matches nothing.
std::vector<CaseInfo> select_cases(const std::vector<std::string>& patterns);

// Times `work`, which makes `calls` calls. `prepare` runs before, untimed.
std::function<Timing(Arena&, Clock)> timed(int calls, std::function<void()> prepare,
                                           std::function<void()> work);

// Returns a position that is farther from all earlier ones than any receptive field: no cached
// result can be reused there.
std::array<std::int64_t, 3> unvisited_place();

}  // namespace solidtex::tools
