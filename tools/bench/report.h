// Reports of the measurements, for people and for scripts.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tools/bench/measure.h"

namespace solidtex::tools {

struct Report {
  std::string text;
  nlohmann::ordered_json json;
};

// A table of the cases, then their ratios.
std::string text_report(const Results& results, const CaseSettings& cases,
                        const MeasureSettings& settings);

// The JSON of Google Benchmark. The settings, peaks and ratios are in its context.
nlohmann::ordered_json json_report(const Results& results, const CaseSettings& cases,
                                   const MeasureSettings& settings);

// "1.25 Mvoxel/s"
std::string format_rate(double rate, const std::string& unit);

}  // namespace solidtex::tools
