#include "tools/bench/cases.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace solidtex::tools {
namespace {

const std::string old_prefix = "field.", new_prefix = "lattice.";

const solidtex::texture& opened(std::optional<solidtex::texture>& texture, const std::string& model,
                                solidtex_family family, const solidtex::options& options = {}) {
  if (!texture) texture.emplace(model, options);
  if (texture->family() != family)
    throw std::runtime_error(
        fmt::format("{}: found a model of the {} family, expected one of the {} family", model,
                    family == SOLIDTEX_FAMILY_LATTICE ? "sampler" : "lattice",
                    family == SOLIDTEX_FAMILY_LATTICE ? "lattice" : "sampler"));
  return *texture;
}

std::string joined_names(const std::vector<CaseInfo>& cases) {
  std::string names;
  for (const CaseInfo& info : cases) names += (names.empty() ? "" : ", ") + info.name;
  return names;
}

}  // namespace

const solidtex::texture& Models::lattice() {
  return opened(lattice_, settings_.lattice_model, SOLIDTEX_FAMILY_LATTICE);
}

const solidtex::texture& Models::sampler() {
  return opened(sampler_, settings_.sampler_model, SOLIDTEX_FAMILY_SAMPLER);
}

const solidtex::texture& Models::fast_sampler() {
  return opened(fast_sampler_, settings_.sampler_model, SOLIDTEX_FAMILY_SAMPLER,
                {.precision = "fast"});
}

std::vector<CaseInfo> all_cases() {
  std::vector<CaseInfo> result;
  for (auto& cases : {lattice_cases(), sampler_cases(), noise_cases(), bake_cases()})
    result.insert(result.end(), cases.begin(), cases.end());
  return result;
}

std::vector<CaseInfo> select_cases(const std::vector<std::string>& patterns) {
  const std::vector<CaseInfo> all = all_cases();
  const auto matches = [](const std::string& pattern, const CaseInfo& info) {
    const std::string name =
        pattern.starts_with(old_prefix) ? new_prefix + pattern.substr(old_prefix.size()) : pattern;
    return fnmatch(name.c_str(), info.name.c_str(), 0) == 0;
  };
  for (const std::string& pattern : patterns)
    if (std::none_of(all.begin(), all.end(),
                     [&](const CaseInfo& info) { return matches(pattern, info); }))
      throw std::invalid_argument(
          fmt::format("no case is called \"{}\", expected one of {}", pattern, joined_names(all)));
  std::vector<CaseInfo> result;
  for (const CaseInfo& info : all) {
    const bool named =
        std::any_of(patterns.begin(), patterns.end(),
                    [&](const std::string& pattern) { return matches(pattern, info); });
    if (named || (patterns.empty() && info.usual)) result.push_back(info);
  }
  return result;
}

std::function<Timing(Arena&, Clock)> timed(int calls, std::function<void()> prepare,
                                           std::function<void()> work) {
  return [calls, prepare = std::move(prepare), work = std::move(work)](Arena& arena, Clock clock) {
    prepare();
    return Timing{arena.time(clock, work) / calls};
  };
}

std::array<std::int64_t, 3> unvisited_place() {
  constexpr std::int64_t distance = 4096, row = 1024;  // multiples of every block and brick
  static std::int64_t visited = 0;
  const std::int64_t place = visited++;
  return {(place % row - row / 2) * distance, (place / row % row - row / 2) * distance,
          place / row / row * distance};
}

}  // namespace solidtex::tools
