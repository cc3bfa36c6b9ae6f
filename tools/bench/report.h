// What was measured, for people and for scripts.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tools/bench/measure.h"

namespace solidtex::tools {

struct Report {
  std::string text;
  nlohmann::ordered_json json;
};

struct Ratio {
  std::string name, about;
  double value;
};

// Those that the measured cases allow.
std::vector<Ratio> derived_ratios(const Results& results, const MeasureSettings& settings);

std::string text_report(const Results& results, const CaseSettings& cases,
                        const MeasureSettings& settings);

// "1.25 Mvoxel/s"
std::string format_rate(double rate, const std::string& unit);

nlohmann::ordered_json json_report(const Results& results, const CaseSettings& cases,
                                   const MeasureSettings& settings);

}  // namespace solidtex::tools
