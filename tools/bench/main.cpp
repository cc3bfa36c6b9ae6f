// solidtex-bench: measures named cases of the library through its public interface.
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <cstdlib>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "tools/bench/compare.h"
#include "tools/bench/options.h"
#include "tools/bench/report.h"
#include "tools/common/output_file.h"

namespace {

using namespace solidtex::tools;

void print_list() {
  for (const CaseInfo& info : all_cases())
    std::cout << fmt::format("{:<25} {:<12} {}{}\n", info.name,
                             info.parallel ? "all threads" : "one thread", info.about,
                             info.usual ? "" : " (only when named)");
}

// Linux names the processor in its table of processors, except on some ARM machines.
std::string processor_name() {
  std::ifstream table("/proc/cpuinfo");
  for (std::string line; std::getline(table, line);)
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  return "unknown";
}

void print_machine(int threads) {
  std::cout << fmt::format(
      "solidtex         {}\nprocessor        {}\nthreads          {}\ninstruction set  {}\n",
      solidtex::version(), processor_name(), threads, solidtex::target());
}

void write_json(const std::filesystem::path& target, const nlohmann::ordered_json& report) {
  const std::string text = report.dump(2) + '\n';
  write_completely(target, [&](const std::filesystem::path& temporary) {
    OutputFile file(temporary);
    file.write(0, text.data(), text.size());
    file.close();
  });
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
  if (options.machine) return print_machine(options.measure.threads);
  options.measure.quick = options.cases.quick;
  install_interrupt_handler();
  const bool is_piped = options.json == "-";
  if (!options.json.empty() && !is_piped) check_output(options.json, {}, options.force);
  const bool compare = options.compare_targets || options.targets.size() > 1;
  const Report report = compare ? compare_targets(options) : measure_here(options);
  if (is_piped) {
    std::cout << report.json.dump(2) << '\n';
    return say(report.text);
  }
  if (!options.json.empty()) write_json(options.json, report.json);
  std::cout << report.text;
}

// Gives --benchmark_... to Google Benchmark and returns the other arguments. Without interleaving
// other programs could meet all repetitions of one case.
std::vector<char*> other_arguments(int argc, char** argv) {
  static char interleaving[] = "--benchmark_enable_random_interleaving=true";
  std::vector<char*> own{argv[0], interleaving}, others;
  for (int i = 0; i < argc; ++i)
    (std::string(argv[i]).starts_with("--benchmark_") ? own : others).push_back(argv[i]);
  int count = static_cast<int>(own.size());
  benchmark::Initialize(&count, own.data());
  return others;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<char*> arguments = other_arguments(argc, argv);
  CLI::App app("Measures how fast this machine evaluates solid textures.", "solidtex-bench");
  BenchOptions options;
  add_options(app, options);
  return run_tool(app, static_cast<int>(arguments.size()), arguments.data(), [&] { run(options); });
}
