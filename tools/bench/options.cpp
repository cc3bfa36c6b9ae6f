#include "tools/bench/options.h"

#include <tbb/info.h>

namespace solidtex::tools {
namespace {

constexpr char examples[] =
    "Examples:\n"
    "  solidtex-bench                           the usual cases, on all cores\n"
    "  solidtex-bench --list                    list the cases\n"
    "  solidtex-bench 'lattice.*' --seconds 10    more repetitions of some\n"
    "  solidtex-bench lattice.256 --scaling       with one thread and with all, in turn\n"
    "  solidtex-bench lattice.32 --target AVX2,AVX3\n"
    "  solidtex-bench bake.memory --bake-size 1024\n"
    "  solidtex-bench --clock cpu --json a.json for scripts, on a shared machine\n"
    "Options of Google Benchmark (--benchmark_filter=REGEX, ...) are accepted as well.";

// A pattern that matches nothing is a usage error.
std::string check_pattern(const std::string& pattern) {
  try {
    select_cases({pattern});
    return "";
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
}

}  // namespace

void add_options(CLI::App& app, BenchOptions& options) {
  app.footer(examples);
  app.add_option("CASES", options.patterns,
                 "Names of cases, or globs (default: the usual cases; field.* is lattice.*)")
      ->check(CLI::Validator(check_pattern, ""));
  app.add_flag("--list", options.list, "Print the cases instead of running them");
  app.add_flag("--machine", options.machine,
               "Print version, processor, threads and instruction set instead");
  options.measure.threads = tbb::info::default_concurrency();
  app.add_option("--threads", options.measure.threads,
                 "Threads of the parallel cases (default: all cores)")
      ->check(in_range(1, 1024));
  app.add_option("--seconds", options.measure.seconds, "Time for each case")
      ->check(in_range(0.001, 86400.0))
      ->capture_default_str();
  app.add_option("--rounds", options.measure.rounds,
                 "Repetitions that share this time; those of all cases alternate")
      ->check(in_range(1, 1000))
      ->capture_default_str();
  const std::map<std::string, Clock> clocks = {{"wall", Clock::wall}, {"cpu", Clock::cpu}};
  app.add_option("--clock", options.measure.clock,
                 "wall, or cpu: processor time divided by threads, for a shared machine")
      ->transform(one_of(clocks))
      ->type_name("wall|cpu");
  app.add_flag("--scaling", options.measure.scaling, "Run parallel cases on one thread too");
  auto* target = app.add_option("--target", options.targets,
                                "Instruction set to run on (see SOLIDTEX_TARGET); several are "
                                "compared, in turn")
                     ->delimiter(',')
                     ->allow_extra_args(false)
                     ->type_name("NAME[,NAME...]");
  app.add_flag("--compare-targets", options.compare_targets,
               "Compare all instruction sets with fused multiply-add")
      ->excludes(target);
  app.add_option("--lattice-model,--field-model", options.cases.lattice_model,
                 "Model of lattice.* and bake.*")
      ->capture_default_str();
  app.add_option("--sampler-model", options.cases.sampler_model, "Model of sampler.*")
      ->capture_default_str();
  app.add_option("--bake-size", options.cases.bake_size,
                 "Voxels along each axis for bake.memory; 1024 needs 13 GB of disk")
      ->check(in_range(1, 4096))
      ->capture_default_str();
  app.add_flag("--quick", options.cases.quick,
               "Run everything tiny and once: shows that it runs, not how fast");
  app.add_option(
         "--json", options.json,
         "Write the results to a file as well, in the JSON of Google Benchmark; -: to standard "
         "output")
      ->type_name("FILE");
  app.add_flag("--force", options.force, "Replace the file if it exists");
}

}  // namespace solidtex::tools
