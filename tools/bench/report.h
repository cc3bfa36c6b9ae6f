// What was measured, for people and for scripts.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tools/bench/measure.h"

namespace solidtex::tools {

struct Ratio {
  std::string name, about;
  double value;
};

// Those that the measured cases allow.
std::vector<Ratio> derived_ratios(const Results& results, int threads);

std::string text_report(const Results& results, const CaseSettings& cases,
                        const MeasureSettings& settings);

nlohmann::ordered_json json_report(const Results& results, const CaseSettings& cases,
                                   const MeasureSettings& settings);

}  // namespace solidtex::tools
