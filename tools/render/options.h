// Command line of solidtex-render.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <solidtex/pathtracer.hpp>
#include <string>
#include <vector>

namespace solidtex::tools {

struct Options {
  std::filesystem::path scene, output;  // a scene file; with a model, a mesh

  // Of a mesh without a scene file.
  std::string model;
  std::uint64_t variant = 0;
  std::optional<double> texels_per_unit;
  std::string up = "y";

  // These override the scene's settings.
  std::vector<int> size;
  std::optional<int> samples;
  std::optional<double> noise;
  std::optional<std::uint64_t> seed;
  std::optional<pathtracer::TextureFilter> texture_filter;
  std::optional<pathtracer::ViewTransform> view_transform;
  std::optional<float> exposure;

  int threads = 0;
  std::vector<int> crop;
  std::vector<std::string> aovs;
  std::optional<pathtracer::Aov> view;

  double preview_every = 0;          // seconds; 0: never
  std::filesystem::path checkpoint;  // empty: none
  double checkpoint_every = 60;      // seconds

  std::optional<std::string> frames;  // "12" or "0-47"
  int turntable = 0;                  // frames; 0: none
  bool resume = false;
  bool denoise = false;
  bool force = false, stats = false;
};

void add_options(CLI::App& app, Options& options);

// Opens the scene file or the mesh. Throws for a mesh without a model, and a model with a scene.
pathtracer::Sequence open_sequence(const Options& options);

// Returns the scene's settings, overridden by the command line.
pathtracer::RenderSettings settings_for(const pathtracer::Scene& scene, const Options& options);
// Returns the AOVs to write: what is rendered besides guides the denoiser.
pathtracer::AovSet aovs_to_write(const Options& options);
pathtracer::Display display_for(const pathtracer::Scene& scene, const Options& options);

struct Frame {
  int number = 0;
  std::filesystem::path output;
};

// Returns the requested frames, with --resume those whose output does not exist. Throws for frames
// that the scene does not have, and if several frames would have one output name.
std::vector<Frame> frames_to_render(const Options& options, int frame_count);

}  // namespace solidtex::tools
