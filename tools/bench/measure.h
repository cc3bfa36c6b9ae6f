// Runs the cases round after round, with samples of the peak between them, so that what else
// happens on the machine meets all of them alike.
#pragma once

#include <map>
#include <vector>

#include "tools/bench/cases.h"

namespace solidtex::tools {

struct MeasureSettings {
  int threads = 1;
  int rounds = 3;
  double seconds = 2;  // for each case, over all rounds; a case runs at least once a round
  Clock clock = Clock::wall;
  bool scaling = false;  // parallel cases run on one thread too
  bool quick = false;
};

struct Measurement {
  CaseInfo info;
  Case work;
  int threads = 1;
  std::vector<double> seconds;  // of one call, a value for each repetition
  std::uint64_t peak_resident_bytes = 0;

  double best() const;
  double median() const;
  double units_per_second() const { return work.units_per_call / best(); }
  // Floating-point operations of the direct method that the best repetition stands for.
  double direct_flops() const { return 2 * work.multiply_adds_per_unit * units_per_second(); }
};

struct Results {
  std::vector<Measurement> measurements;
  std::map<int, std::vector<double>> peaks;  // by threads: operations a second, samples

  double peak(int threads) const;
  // nullptr where it was not measured.
  const Measurement* find(const std::string& name, int threads) const;
};

// Throws Interrupted after Ctrl-C.
Results measure(const std::vector<CaseInfo>& cases, Models& models,
                const CaseSettings& case_settings, const MeasureSettings& settings);

}  // namespace solidtex::tools
