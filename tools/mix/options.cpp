#include "tools/mix/options.h"

#include <charconv>
#include <cmath>
#include <stdexcept>

#include "plugins/spaces/mixture.h"
#include "tools/common/cli.h"
#include "tools/common/output_file.h"

namespace solidtex::tools {
namespace {

using Weights = std::vector<double>;

constexpr char kExamples[] =
    "Examples:\n"
    "  solidtex-mix a.solidtex b.solidtex -o half.solidtex\n"
    "  solidtex-mix a.solidtex b.solidtex --weights 0.8,0.2 -o mostly-a.solidtex\n"
    "  solidtex-mix stones:Granite_007 mine.solidtex -o mixed.solidtex\n"
    "                    a training photograph of the space \"stones\" and a model\n"
    "  solidtex-mix a.solidtex b.solidtex c.solidtex --animate 25 -o walk-####.solidtex\n"
    "                    walk-0000 is a, walk-0012 b, walk-0024 c\n"
    "  solidtex-mix a.solidtex b.solidtex --weights 1,0 --weights 0.5,0.5 --animate 9 \\\n"
    "               -o walk-#.solidtex\n"
    "                    from a to the middle\n"
    "A mixture costs what each of its inputs costs: codes and colors are mixed, not values.\n"
    "Models that were fine-tuned, or have no space, cannot be mixed; a scene of solidtex-render\n"
    "can blend any models (docs/scene-format.md).\n"
    "Exit code: 0 success, 1 nothing can be mixed or written, 2 wrong usage, 130 interrupted.";

[[noreturn]] void refuse_weights(const std::string& text, const std::string& expected) {
  throw std::runtime_error("--weights: found " + text + ", expected " + expected);
}

Weights parse_weights(const std::string& text, std::size_t count) {
  const std::string expected =
      std::to_string(count) + " numbers of 0 or more, one above 0, as in 0.5,0.5";
  Weights weights;
  double sum = 0;
  const char *place = text.data(), *end = text.data() + text.size();
  while (true) {
    double weight = 0;
    const auto [next, problem] = std::from_chars(place, end, weight);
    if (problem != std::errc() || !std::isfinite(weight) || weight < 0) {
      refuse_weights(text, expected);
    }
    weights.push_back(weight);
    sum += weight;
    if (next == end) break;
    if (*next != ',') refuse_weights(text, expected);
    place = next + 1;
  }
  if (weights.size() != count || !(sum > 0) || !std::isfinite(sum)) refuse_weights(text, expected);
  for (double& weight : weights) weight /= sum;
  return weights;
}

// Places that the walk visits in equal steps.
std::vector<Weights> stops_of(const MixOptions& options) {
  const std::size_t count = options.inputs.size();
  std::vector<Weights> stops;
  for (const std::string& text : options.weights) stops.push_back(parse_weights(text, count));
  if (!stops.empty()) return stops;
  for (std::size_t i = 0; i < count; ++i) {
    Weights weights(count);
    weights[i] = 1;
    stops.push_back(weights);
  }
  return stops;
}

Weights between(const std::vector<Weights>& stops, double position) {
  const Weights shares = spaces::weights_at(position, stops.size());
  Weights result(stops.front().size());
  for (std::size_t i = 0; i < stops.size(); ++i) {
    for (std::size_t k = 0; k < result.size(); ++k) result[k] += shares[i] * stops[i][k];
  }
  return result;
}

Frame single_model(const MixOptions& options) {
  if (options.weights.size() > 1) {
    throw std::runtime_error("--weights: found it " + std::to_string(options.weights.size()) +
                             " times, expected once without --animate");
  }
  const std::size_t count = options.inputs.size();
  if (options.weights.empty()) return {options.output, Weights(count, 1)};
  return {options.output, parse_weights(options.weights.front(), count)};
}

}  // namespace

void add_options(CLI::App& app, MixOptions& options) {
  app.add_option("MATERIAL", options.inputs,
                 "Two or more materials of one texture space: paths or names of models, or "
                 "training photographs, SPACE:PHOTOGRAPH")
      ->required()
      ->expected(2, 100000)
      ->option_text("A B [C...]");
  app.add_option("--weights", options.weights,
                 "A weight for each material (default: equal); with --animate, give it for each "
                 "place of the walk (default: the materials in their order)")
      ->allow_extra_args(false)
      ->option_text("W,W,...");
  app.add_option("--space", options.space,
                 "Name or path of the space (default: the one that the first material names)")
      ->option_text("NAME|FILE");
  app.add_option("-o,--output", options.output,
                 "Model to write, or - for standard output; #### becomes the number of a walk's "
                 "model")
      ->required()
      ->option_text("FILE.solidtex");
  app.add_option("--animate", options.frames,
                 "Write N models on a walk in equal steps, ends included")
      ->check(in_range(2, 100000))
      ->option_text("N");
  app.add_flag("--force", options.force, "Overwrite existing models");
  app.footer(kExamples);
}

std::vector<Frame> frames_of(const MixOptions& options) {
  if (lower_extension(options.output) != ".solidtex") {
    throw std::runtime_error(options.output.string() +
                             ": found another ending, expected a name that ends with .solidtex");
  }
  if (options.frames == 0) return {single_model(options)};
  if (!has_number(options.output)) {
    throw std::runtime_error(options.output.string() + ": found one name for " +
                             std::to_string(options.frames) +
                             " models, expected a name with a number, " +
                             options.output.stem().string() + "-####.solidtex");
  }
  const std::vector<Weights> stops = stops_of(options);
  if (stops.size() < 2) {
    throw std::runtime_error(
        "--weights: found it once, expected it for two or more places of the "
        "walk");
  }
  std::vector<Frame> frames;
  for (int i = 0; i < options.frames; ++i) {
    const double position = i / static_cast<double>(options.frames - 1);
    frames.push_back({numbered(options.output, i), between(stops, position)});
  }
  return frames;
}

}  // namespace solidtex::tools
