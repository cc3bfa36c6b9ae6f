#include "tools/bench/measure.h"

#include <algorithm>
#include <limits>

#include "tools/bench/peak.h"
#include "tools/common/cli.h"
#include "tools/common/progress.h"

namespace solidtex::tools {
namespace {

// Seconds between samples of the peak: the best sample has the same chance of a quiet moment as the
// best call.
constexpr double peak_interval = 0.025;

// Keeps what Google Benchmark reports; report.h prints it.
class Collector : public benchmark::BenchmarkReporter {
 public:
  explicit Collector(std::vector<Run>& runs) : runs_(runs) {}
  bool ReportContext(const Context&) override { return true; }
  void ReportRuns(const std::vector<Run>& runs) override {
    runs_.insert(runs_.end(), runs.begin(), runs.end());
  }

 private:
  std::vector<Run>& runs_;
};

class Session {
 public:
  Session(Results& results, const MeasureSettings& settings)
      : results_(results),
        settings_(settings),
        progress_("Measuring on " + solidtex::target(),
                  results.measurements.size() * milliseconds(settings.seconds)) {
    for (Measurement& measurement : results.measurements) {
      arenas_.try_emplace(measurement.threads, measurement.threads);
      add(measurement);
    }
  }

  void run() {
    Collector collector(results_.runs);
    benchmark::RunSpecifiedBenchmarks(&collector);
    throw_if_interrupted();
    progress_.finish();
  }

 private:
  static std::uint64_t milliseconds(double seconds) {
    return static_cast<std::uint64_t>(seconds * 1000);
  }

  void add(Measurement& measurement) {
    const auto run = [this, &measurement](benchmark::State& state) { time(measurement, state); };
    auto* const added = benchmark::RegisterBenchmark(measurement.info.name.c_str(), run);
    added->ArgName("threads")->Arg(measurement.threads)->UseManualTime();
    const bool once = measurement.info.once || settings_.quick;
    added->Repetitions(once ? 1 : settings_.rounds);
    if (once)
      added->Iterations(1);
    else
      added->MinTime(settings_.seconds / settings_.rounds);
  }

  void time(Measurement& measurement, benchmark::State& state) {
    const Stopwatch stopwatch(Clock::wall);
    sample_peak(measurement.threads);
    double best = std::numeric_limits<double>::infinity();
    for (auto _ : state) {
      if (interrupted()) {
        state.SkipWithError("interrupted");
        break;
      }
      const Timing timing =
          measurement.work.time_call(arenas_.at(measurement.threads), settings_.clock);
      state.SetIterationTime(timing.seconds);
      best = std::min(best, timing.seconds);
      measurement.seconds.push_back(timing.seconds);
      measurement.peak_resident_bytes =
          std::max(measurement.peak_resident_bytes, timing.peak_resident_bytes);
      if (since_peak_.seconds() > peak_interval) sample_peak(measurement.threads);
    }
    sample_peak(measurement.threads);
    add_counters(measurement, best, state);
    progress_.advance(milliseconds(stopwatch.seconds()));
  }

  static void add_counters(const Measurement& measurement, double best, benchmark::State& state) {
    const Case& work = measurement.work;
    state.SetLabel(work.unit);
    state.counters["units_per_call"] = work.units_per_call;
    state.counters["best_seconds"] = best;
    state.counters["units_per_second"] = work.units_per_call / best;
    if (measurement.peak_resident_bytes)
      state.counters["peak_resident_bytes"] = static_cast<double>(measurement.peak_resident_bytes);
    if (work.multiply_adds_per_unit == 0) return;
    state.counters["multiply_adds_per_unit"] = work.multiply_adds_per_unit;
    state.counters["direct_flops"] = 2 * work.multiply_adds_per_unit * work.units_per_call / best;
  }

  void sample_peak(int threads) {
    results_.peaks[threads].push_back(measure_peak(threads, settings_.clock));
    since_peak_ = Stopwatch(Clock::wall);
  }

  Results& results_;
  const MeasureSettings& settings_;
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
  Session(results, settings).run();
  // What --benchmark_filter leaves out.
  std::erase_if(results.measurements, [](const Measurement& m) { return m.seconds.empty(); });
  return results;
}

}  // namespace solidtex::tools
