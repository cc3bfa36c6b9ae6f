// The named cases: what each asks of the library, and how one repetition is timed.
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

struct Repetition {
  double seconds = 0;                     // of one call
  std::uint64_t peak_resident_bytes = 0;  // where the case measures memory
};

struct Case {
  std::string unit;                   // "voxel", "point", "value"
  double units_per_call = 1;          // a repetition is one call, or many short ones
  double multiply_adds_per_unit = 0;  // of the direct method; 0 where there is nothing to count
  std::function<Repetition(Arena&, Clock)> repeat;
};

struct CaseSettings {
  std::string field_model = "granite-grey", sampler_model = "stone-grey";
  std::int64_t bake_size = 256;
  bool quick = false;  // everything tiny: to see that it runs
};

// Opens the models when the first case needs them; checks that each is of the family it stands for.
class Models {
 public:
  explicit Models(const CaseSettings& settings) : settings_(settings) {}
  const solidtex::texture& field();
  const solidtex::texture& sampler();
  const solidtex::texture& fast_sampler();

 private:
  const CaseSettings& settings_;
  std::optional<solidtex::texture> field_, sampler_, fast_sampler_;
};

struct CaseInfo {
  std::string name, about;
  bool parallel = false;  // runs on all threads; the others on one
  bool usual = true;      // part of a run that names no case
  bool once = false;      // too long to repeat
  std::function<Case(Models&, const CaseSettings&)> make;
};

std::vector<CaseInfo> field_cases();
std::vector<CaseInfo> sampler_cases();
std::vector<CaseInfo> noise_cases();
std::vector<CaseInfo> bake_cases();

std::vector<CaseInfo> all_cases();

// The cases that match any of the names or globs, in the order of the list; the usual ones where
// there is none. Throws when one matches nothing.
std::vector<CaseInfo> select_cases(const std::vector<std::string>& patterns);

// Times `work`, which makes `calls` calls; `prepare` runs before, untimed.
std::function<Repetition(Arena&, Clock)> timed(int calls, std::function<void()> prepare,
                                               std::function<void()> work);

// A place that no case of this process has asked for, further from every other than any network
// reaches: nothing of what was computed before can be of use there.
std::array<std::int64_t, 3> unvisited_place();

}  // namespace solidtex::tools
