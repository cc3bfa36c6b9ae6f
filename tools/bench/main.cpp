// solidtex-bench: times named cases of the library through its public interface.
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <fstream>
#include <iostream>
#include <optional>

#include "tools/bench/options.h"
#include "tools/bench/report.h"
#include "tools/common/atomic_file.h"

namespace {

using namespace solidtex::tools;

void print_list() {
  for (const CaseInfo& info : all_cases())
    std::cout << fmt::format("{:<20} {:<12} {}{}\n", info.name,
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

void run(BenchOptions& options) {
  if (options.list) return print_list();
  options.measure.quick = options.cases.quick;
  install_interrupt_handler();
  std::optional<AtomicFile> json;
  if (!options.json.empty()) {
    refuse_overwrite(options.json, options.force);
    json.emplace(options.json);
  }
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(options.measure.threads));
  Models models(options.cases);
  const Results results =
      measure(select_cases(options.patterns), models, options.cases, options.measure);
  if (json) write_json(*json, json_report(results, options.cases, options.measure));
  std::cout << text_report(results, options.cases, options.measure);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Measures how fast this machine evaluates solid textures.", "solidtex-bench");
  BenchOptions options;
  add_options(app, options);
  return run_tool(app, argc, argv, [&] { run(options); });
}
