#include "tools/bench/measure.h"

#include <algorithm>

#include "tools/bench/peak.h"
#include "tools/common/cli.h"
#include "tools/common/progress.h"

namespace solidtex::tools {
namespace {

// Often, so that the best sample has the same chance of a quiet moment as the best repetition.
constexpr double peak_interval = 0.025;

std::uint64_t milliseconds(double seconds) { return static_cast<std::uint64_t>(seconds * 1000); }

class Run {
 public:
  Run(Results& results, const MeasureSettings& settings)
      : results_(results),
        settings_(settings),
        rounds_(settings.quick ? 1 : settings.rounds),
        progress_("Measuring on " + solidtex::target(), results.measurements.size() *
                                                            static_cast<std::uint64_t>(rounds_) *
                                                            milliseconds(round_seconds())) {
    for (const Measurement& measurement : results.measurements)
      arenas_.try_emplace(measurement.threads, measurement.threads);
  }

  void all_rounds() {
    for (int round = 0; round < rounds_; ++round)
      for (Measurement& measurement : results_.measurements) {
        if (round == 0 || !measurement.info.once) one_round(measurement);
        progress_.advance(milliseconds(round_seconds()));
      }
    progress_.finish();
  }

 private:
  double round_seconds() const { return settings_.quick ? 0.01 : settings_.seconds / rounds_; }

  void sample_peak(int threads) {
    results_.peaks[threads].push_back(measure_peak(threads, settings_.clock));
    since_peak_ = Stopwatch(Clock::wall);
  }

  void one_round(Measurement& measurement) {
    const Stopwatch stopwatch(Clock::wall);
    sample_peak(measurement.threads);
    do {
      throw_if_interrupted();
      const Repetition found =
          measurement.work.repeat(arenas_.at(measurement.threads), settings_.clock);
      measurement.seconds.push_back(found.seconds);
      measurement.peak_resident_bytes =
          std::max(measurement.peak_resident_bytes, found.peak_resident_bytes);
      if (since_peak_.seconds() > peak_interval) sample_peak(measurement.threads);
    } while (!settings_.quick && !measurement.info.once && stopwatch.seconds() < round_seconds());
    sample_peak(measurement.threads);
  }

  Results& results_;
  const MeasureSettings& settings_;
  const int rounds_;
  std::map<int, Arena> arenas_;
  Progress progress_;
  Stopwatch since_peak_{Clock::wall};
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
