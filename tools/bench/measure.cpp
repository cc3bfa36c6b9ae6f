#include "tools/bench/measure.h"

#include <algorithm>

#include "tools/bench/peak.h"
#include "tools/common/cli.h"
#include "tools/common/progress.h"

namespace solidtex::tools {
namespace {

constexpr int usual_rounds = 3;

std::uint64_t milliseconds(double seconds) { return static_cast<std::uint64_t>(seconds * 1000); }

class Run {
 public:
  Run(Results& results, const MeasureSettings& settings)
      : results_(results),
        settings_(settings),
        rounds_(settings.quick ? 1 : usual_rounds),
        progress_("Measuring", results.measurements.size() * static_cast<std::uint64_t>(rounds_) *
                                   milliseconds(round_seconds())) {}

  void all_rounds() {
    for (int round = 0; round < rounds_; ++round)
      for (Measurement& measurement : results_.measurements) {
        sample_peak(measurement.threads);
        if (round == 0 || !measurement.info.once) one_round(measurement);
        progress_.advance(milliseconds(round_seconds()));
      }
    for (const auto& [threads, samples] : std::map(results_.peaks)) sample_peak(threads);
    progress_.finish();
  }

 private:
  double round_seconds() const { return settings_.quick ? 0.01 : settings_.seconds / rounds_; }

  void sample_peak(int threads) {
    results_.peaks[threads].push_back(measure_peak(threads, settings_.clock));
  }

  void one_round(Measurement& measurement) {
    const Stopwatch stopwatch(Clock::wall, 1);
    do {
      throw_if_interrupted();
      const Repetition found = measurement.work.repeat(measurement.threads, settings_.clock);
      measurement.seconds.push_back(found.seconds);
      measurement.peak_resident_bytes =
          std::max(measurement.peak_resident_bytes, found.peak_resident_bytes);
    } while (!settings_.quick && !measurement.info.once && stopwatch.seconds() < round_seconds());
  }

  Results& results_;
  const MeasureSettings& settings_;
  const int rounds_;
  Progress progress_;
};

}  // namespace

double Measurement::best() const { return *std::min_element(seconds.begin(), seconds.end()); }

double Measurement::median() const {
  std::vector<double> sorted = seconds;
  std::sort(sorted.begin(), sorted.end());
  const std::size_t half = sorted.size() / 2;
  return sorted.size() % 2 ? sorted[half] : (sorted[half - 1] + sorted[half]) / 2;
}

double Results::peak(int threads) const {
  const std::vector<double>& samples = peaks.at(threads);
  return *std::max_element(samples.begin(), samples.end());
}

const Measurement* Results::find(const std::string& name, int threads) const {
  for (const Measurement& measurement : measurements)
    if (measurement.info.name == name && measurement.threads == threads) return &measurement;
  return nullptr;
}

Results measure(const std::vector<CaseInfo>& cases, Models& models,
                const CaseSettings& case_settings, const MeasureSettings& settings) {
  Results results;
  for (const CaseInfo& info : cases) {
    const int threads = info.parallel ? settings.threads : 1;
    const Case work = info.make(models, case_settings);
    if (settings.scaling && threads > 1) results.measurements.push_back({info, work, 1, {}, 0});
    results.measurements.push_back({info, work, threads, {}, 0});
  }
  Run(results, settings).all_rounds();
  return results;
}

}  // namespace solidtex::tools
