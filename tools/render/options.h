// What the command line asks for.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <solidtex/pathtracer.hpp>
#include <vector>

namespace solidtex::tools {

struct Options {
  std::filesystem::path scene, output;

  // These win over the scene's own settings.
  std::vector<int> size;
  std::optional<int> samples;
  std::optional<double> noise;
  std::optional<std::uint64_t> seed;
  std::optional<pathtracer::TextureFilter> texture_filter;
  std::optional<pathtracer::ViewTransform> view_transform;
  std::optional<float> exposure;

  int threads = 0;
  std::vector<int> crop;
  std::vector<std::string> layers;
  std::optional<pathtracer::Layer> view;

  double preview_every = 0;          // seconds; 0: never
  std::filesystem::path checkpoint;  // empty: none
  double checkpoint_every = 60;      // seconds

  std::optional<std::string> frames;  // "12" or "0-47"
  int turntable = 0;                  // frames; 0: none
  bool resume = false;
  bool force = false, quiet = false, stats = false;
};

void add_options(CLI::App& app, Options& options);

// The scene's settings with those of the command line over them.
pathtracer::RenderSettings settings_for(const pathtracer::Scene& scene, const Options& options);
pathtracer::Display display_for(const pathtracer::Scene& scene, const Options& options);

}  // namespace solidtex::tools
