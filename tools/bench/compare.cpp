#include "tools/bench/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>

#include "tools/bench/child.h"
#include "tools/bench/peak.h"

namespace solidtex::tools {
namespace {

using nlohmann::ordered_json;

// One round of all cases on one instruction set.
std::vector<std::string> command(const BenchOptions& options, const std::string& target,
                                 const std::filesystem::path& json) {
  const MeasureSettings& measure = options.measure;
  std::vector<std::string> words = {sibling_program("solidtex-bench"),
                                    "--target",
                                    target,
                                    "--json",
                                    json,
                                    "--force",
                                    "--rounds",
                                    "1",
                                    "--seconds",
                                    std::to_string(measure.seconds / measure.rounds),
                                    "--threads",
                                    std::to_string(measure.threads),
                                    "--clock",
                                    clock_name(measure.clock),
                                    "--lattice-model",
                                    options.cases.lattice_model,
                                    "--sampler-model",
                                    options.cases.sampler_model,
                                    "--bake-size",
                                    std::to_string(options.cases.bake_size)};
  if (measure.scaling) words.push_back("--scaling");
  if (measure.quick) words.push_back("--quick");
  words.insert(words.end(), options.patterns.begin(), options.patterns.end());
  return words;
}

// The best rate of a case on each target, in the order of the targets.
struct Row {
  std::string name, unit;
  std::vector<double> units_per_second;
};

void add(const ordered_json& report, std::size_t target, std::size_t targets,
         std::vector<Row>& rows) {
  for (const ordered_json& run : report.at("benchmarks")) {
    if (run.at("run_type") != "iteration") continue;
    const std::string name = run.at("name");  // "lattice.256/threads:2"
    auto row = std::ranges::find(rows, name, &Row::name);
    if (row == rows.end())
      row = rows.insert(rows.end(), {name, run.at("label"), std::vector<double>(targets)});
    double& best = row->units_per_second[target];
    best = std::max(best, run.at("units_per_second").get<double>());
  }
}

std::string text_of(const std::vector<std::string>& targets, const std::vector<Row>& rows) {
  std::string text = fmt::format("{:<34}", "case");
  for (const std::string& target : targets) text += fmt::format(" {:>24}", target);
  for (const Row& row : rows) {
    text += fmt::format("\n{:<34}", row.name);
    for (const double rate : row.units_per_second)
      text += fmt::format(" {:>16} {:>5.1f} %", format_rate(rate, row.unit + "/s"),
                          100 * rate / row.units_per_second[0]);
  }
  return text + fmt::format("\n\nThe best of all rounds, and relative to {}.\n", targets[0]);
}

ordered_json json_of(const std::vector<std::string>& targets, const std::vector<Row>& rows,
                     const ordered_json& runs) {
  ordered_json cases = ordered_json::array();
  for (const Row& row : rows) {
    ordered_json rates = ordered_json::object();
    for (std::size_t i = 0; i < targets.size(); ++i) rates[targets[i]] = row.units_per_second[i];
    cases.push_back({{"name", row.name}, {"unit", row.unit}, {"units_per_second", rates}});
  }
  return {{"targets", targets}, {"cases", cases}, {"runs", runs}};
}

}  // namespace

Report compare_targets(const BenchOptions& options) {
  const std::vector<std::string> targets =
      options.compare_targets ? fused_targets() : options.targets;
  if (targets.empty())
    throw std::runtime_error("this machine has no fused multiply-add: name targets with --target");
  const TemporaryFile json(".json");
  std::vector<Row> rows;
  ordered_json runs = ordered_json::array();
  for (int round = 0; round < (options.measure.quick ? 1 : options.measure.rounds); ++round)
    for (std::size_t i = 0; i < targets.size(); ++i) {
      run_child(command(options, targets[i], json.path()));
      runs.push_back(ordered_json::parse(std::ifstream(json.path())));
      add(runs.back(), i, targets.size(), rows);
    }
  return {text_of(targets, rows), json_of(targets, rows, runs)};
}

}  // namespace solidtex::tools
