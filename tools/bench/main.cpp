// solidtex-bench: times named cases of the library through its public interface.
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <cstdlib>
#include <fstream>
#include <iostream>
#include <optional>

#include "tools/bench/compare.h"
#include "tools/bench/options.h"
#include "tools/bench/report.h"
#include "tools/common/output_file.h"

namespace {

using namespace solidtex::tools;

void print_list() {
  for (const CaseInfo& info : all_cases())
    std::cout << fmt::format("{:<23} {:<12} {}{}\n", info.name,
                             info.parallel ? "all threads" : "one thread", info.about,
                             info.usual ? "" : " (only when named)");
}

void write_json(AtomicFile& file, const nlohmann::ordered_json& report) {
  std::ofstream stream(file.temporary_path());
  stream << report.dump(2) << '\n';
  stream.close();
  if (!stream) throw std::runtime_error(file.target().string() + ": cannot write");
  file.commit();
}

Report measure_here(const BenchOptions& options) {
  if (!options.targets.empty()) setenv("SOLIDTEX_TARGET", options.targets[0].c_str(), 1);
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(options.measure.threads));
  Models models(options.cases);
  const Results results =
      measure(select_cases(options.patterns), models, options.cases, options.measure);
  return {text_report(results, options.cases, options.measure),
          json_report(results, options.cases, options.measure)};
}

void run(BenchOptions& options) {
  if (options.list) return print_list();
  options.measure.quick = options.cases.quick;
  install_interrupt_handler();
  std::optional<AtomicFile> json;
  if (!options.json.empty()) {
    refuse_overwrite(options.json, options.force);
    json.emplace(options.json);
  }
  const bool compare = options.compare_targets || options.targets.size() > 1;
  const Report report = compare ? compare_targets(options) : measure_here(options);
  if (json) write_json(*json, report.json);
  std::cout << report.text;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Measures how fast this machine evaluates solid textures.", "solidtex-bench");
  BenchOptions options;
  add_options(app, options);
  return run_tool(app, argc, argv, [&] { run(options); });
}
