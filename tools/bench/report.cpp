#include "tools/bench/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <sstream>

namespace solidtex::tools {
namespace {

using nlohmann::ordered_json;

struct Ratio {
  std::string name, about;
  double value;
};

struct Scale {
  double factor;
  const char* prefix;
};

template <std::size_t N>
std::string scaled(double value, const std::array<Scale, N>& scales, const std::string& unit) {
  const auto fits = [&](const Scale& scale) { return value >= scale.factor; };
  auto found = std::find_if(scales.begin(), scales.end(), fits);
  if (found == scales.end()) --found;
  return fmt::format("{:.3g} {}{}", value / found->factor, found->prefix, unit);
}

std::string format_seconds(double seconds) {
  return scaled(seconds, std::array<Scale, 4>{{{1, ""}, {1e-3, "m"}, {1e-6, "µ"}, {1e-9, "n"}}},
                "s");
}

double thread_seconds_per_unit(const Measurement& measurement) {
  return measurement.threads / measurement.units_per_second();
}

void add_ratio(std::vector<Ratio>& ratios, const std::string& name, const std::string& about,
               const Measurement* upper, const Measurement* lower,
               double (*value)(const Measurement&)) {
  if (upper && lower && upper != lower)
    ratios.push_back({name, about, value(*upper) / value(*lower)});
}

constexpr char row_format[] = "{:<25} {:>7} {:>9} {:>9} {:>5} {:>16} {:>9} {:>8}\n";

std::string row(const Results& results, const Measurement& m) {
  const bool counted = m.work.multiply_adds_per_unit > 0;
  return fmt::format(
      row_format, m.info.name, m.threads, format_seconds(m.best()), format_seconds(m.median()),
      m.seconds.size(), format_rate(m.units_per_second(), m.work.unit + "/s"),
      counted ? fmt::format("{:.1f}", m.direct_flops() * 1e-9) : "",
      counted ? fmt::format("{:.1f} %", 100 * m.direct_flops() / results.peak(m.threads)) : "");
}

std::string cost_lines(const Results& results) {
  std::vector<std::string> lines;
  for (const Measurement& m : results.measurements) {
    if (m.work.multiply_adds_per_unit == 0) continue;
    const std::string line =
        fmt::format("{:.1f} kMAC a {}", m.work.multiply_adds_per_unit * 1e-3, m.work.unit);
    if (std::find(lines.begin(), lines.end(), line) == lines.end()) lines.push_back(line);
  }
  return fmt::format("{}", fmt::join(lines, ", "));
}

constexpr char explanation[] =
    "\nbest, median: seconds of one call. direct GFLOP/s: the arithmetic of direct convolution "
    "over\n"
    "the best time ({}, two operations each).\n"
    "of the peak: relative to the float32 peak that this run measured on as many threads. Less\n"
    "arithmetic (Winograd, sub-pixel convolution) or another unit (fast precision) can exceed\n"
    "100 %.\n";

// The ratios that the measured cases allow.
std::vector<Ratio> derived_ratios(const Results& results, const MeasureSettings& settings) {
  const int threads = settings.threads;
  std::vector<Ratio> ratios;
  const auto rate = [](const Measurement& m) { return m.units_per_second(); };
  const Measurement* box = results.find("lattice.256", 1);
  if (!box) box = results.find("lattice.256", threads);
  for (const char* name : {"lattice.16", "lattice.16.neighbours", "lattice.32"})
    add_ratio(ratios, fmt::format("{} / lattice.256", name), "thread time a voxel",
              results.find(name, 1), box, thread_seconds_per_unit);
  for (const char* name : {"sampler.fast", "sampler.coherent"})
    add_ratio(ratios, fmt::format("{} / sampler.batch", name), "points a second",
              results.find(name, threads), results.find("sampler.batch", threads), rate);
  const auto add_gradients = [&](const std::string& name, int of_threads) {
    add_ratio(ratios, fmt::format("{0}.gradients / {0}", name), "time a point",
              results.find(name + ".gradients", of_threads), results.find(name, of_threads),
              thread_seconds_per_unit);
  };
  add_gradients("lattice.cached", 1);
  add_gradients("sampler.batch", threads);
  add_gradients("sampler.point", 1);
  for (const Measurement& m : results.measurements)
    if (m.info.parallel && m.threads > 1)
      add_ratio(ratios, fmt::format("{}, threads 1 -> {}", m.info.name, m.threads),
                settings.clock == Clock::wall ? "speed-up" : "speed-up, idle threads not counted",
                &m, results.find(m.info.name, 1), rate);
  return ratios;
}

}  // namespace

std::string format_rate(double rate, const std::string& unit) {
  return scaled(rate, std::array<Scale, 4>{{{1e9, "G"}, {1e6, "M"}, {1e3, "k"}, {1, ""}}}, unit);
}

std::string text_report(const Results& results, const CaseSettings& cases,
                        const MeasureSettings& settings) {
  std::string text = fmt::format("solidtex {} on {}, {} and {}, {} clock{}\n", solidtex::version(),
                                 solidtex::target(), cases.lattice_model, cases.sampler_model,
                                 clock_name(settings.clock),
                                 settings.quick ? ", quick: sizes and times mean nothing" : "");
  for (const auto& [threads, samples] : results.peaks)
    text += fmt::format("float32 peak, {} thread{}: {:.0f} GFLOP/s (lowest of {} samples {:.0f})\n",
                        threads, threads == 1 ? "" : "s", results.peak(threads) * 1e-9,
                        samples.size(), *std::min_element(samples.begin(), samples.end()) * 1e-9);
  text += '\n';
  text += fmt::format(row_format, "", "", "", "", "", "", "direct", "of the");
  text += fmt::format(row_format, "case", "threads", "best", "median", "runs", "rate", "GFLOP/s",
                      "peak");
  for (const Measurement& m : results.measurements) text += row(results, m);
  for (const Measurement& m : results.measurements)
    if (m.peak_resident_bytes)
      text += fmt::format("\n{}, threads {}: peak resident memory {:.1f} MiB for {:.0f} {}s\n",
                          m.info.name, m.threads,
                          static_cast<double>(m.peak_resident_bytes) / (1 << 20),
                          m.work.units_per_call, m.work.unit);
  const std::vector<Ratio> ratios = derived_ratios(results, settings);
  if (!ratios.empty()) text += "\n";
  for (const Ratio& ratio : ratios)
    text += fmt::format("{:<42} {:>6.2f}   {}\n", ratio.name, ratio.value, ratio.about);
  return text + fmt::format(explanation, cost_lines(results));
}

ordered_json json_report(const Results& results, const CaseSettings& cases,
                         const MeasureSettings& settings) {
  std::vector<benchmark::BenchmarkReporter::Run> runs = results.runs;
  for (auto& run : runs) {
    // The rest of Google Benchmark's names repeats the settings.
    benchmark::BenchmarkName name;
    name.function_name = run.run_name.function_name;
    name.args = run.run_name.args;
    run.run_name = name;
    const auto flops = run.counters.find("direct_flops");
    if (flops == run.counters.end() || run.run_type != run.RT_Iteration) continue;
    const int threads = std::stoi(run.run_name.args.substr(run.run_name.args.find(':') + 1));
    run.counters["peak_fraction"] = flops->second.value / results.peak(threads);
  }
  std::ostringstream stream, errors;
  benchmark::JSONReporter reporter;
  reporter.SetOutputStream(&stream);
  reporter.SetErrorStream(&errors);
  reporter.ReportContext({});
  reporter.ReportRuns(runs);
  reporter.Finalize();
  ordered_json report = ordered_json::parse(stream.str());
  ordered_json& context = report["context"];
  context["solidtex_version"] = solidtex::version();
  context["target"] = solidtex::target();
  context["lattice_model"] = cases.lattice_model;
  context["sampler_model"] = cases.sampler_model;
  context["threads"] = settings.threads;
  context["clock"] = clock_name(settings.clock);
  context["quick"] = settings.quick;
  for (const auto& [threads, samples] : results.peaks)
    context["peaks"].push_back(
        {{"threads", threads}, {"flops", results.peak(threads)}, {"samples", samples}});
  context["ratios"] = ordered_json::object();
  for (const Ratio& ratio : derived_ratios(results, settings))
    context["ratios"][ratio.name] = ratio.value;
  return report;
}

}  // namespace solidtex::tools
