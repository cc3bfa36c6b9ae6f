// Runs the cases through Google Benchmark, and samples the peak of the machine between the calls.
#pragma once

#include <benchmark/benchmark.h>

#include <map>
#include <vector>

#include "tools/bench/cases.h"

namespace solidtex::tools {

struct MeasureSettings {
  int threads = 1;
  int rounds = 3;      // repetitions of each case; those of all cases alternate at random
  double seconds = 2;  // for each case, over all rounds; at least one call a round
  Clock clock = Clock::wall;
  bool scaling = false;  // parallel cases run on one thread too
  bool quick = false;    // one call in one round
};

struct Measurement {
  CaseInfo info;
  Case work;
  int threads = 1;
  std::vector<double> seconds;  // of one call, a value for each timed call
  std::uint64_t peak_resident_bytes = 0;

  double best() const;
  double median() const;
  double units_per_second() const { return work.units_per_call / best(); }
  // Floating-point operations a second of direct convolution, from the best time.
  double direct_flops() const { return 2 * work.multiply_adds_per_unit * units_per_second(); }
};

struct Results {
  std::vector<Measurement> measurements;
  std::map<int, std::vector<double>> peaks;             // samples by threads, operations a second
  std::vector<benchmark::BenchmarkReporter::Run> runs;  // as Google Benchmark reports them

  double peak(int threads) const;
  // nullptr where it was not measured.
  const Measurement* find(const std::string& name, int threads) const;
};

// Throws Interrupted after Ctrl-C.
Results measure(const std::vector<CaseInfo>& cases, Models& models,
                const CaseSettings& case_settings, const MeasureSettings& settings);

}  // namespace solidtex::tools
