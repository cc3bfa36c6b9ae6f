#include "tools/render/options.h"

#include <fmt/format.h>

#include <map>

namespace solidtex::tools {
namespace {

namespace pt = solidtex::pathtracer;

constexpr const char* kExamples = R"(Examples:
  solidtex-render scenes/demo.json -o demo.png
  solidtex-render scene.json --spp 256 --size 1920,1080 -o scene.exr
  solidtex-render scene.json --spp 4 --force -o quick.png     a quick look
  solidtex-render scene.json --layers all -o scene.exr        for compositing
  solidtex-render scene.json --view normal -o normal.png      a look at one layer
  solidtex-render scene.json --spp 4096 --noise 0.02 --checkpoint scene.state -o scene.exr
  solidtex-render scene.json --turntable 36 -o turn.####.png

Options given here win over the scene's own "render" settings. The same scene, size, samples and
seed give the same picture, bit for bit, with any number of threads.
An EXR holds linear light; a PNG is brightened by the exposure and encoded by the view transform.
The scene format is described in docs/scene-format.md, what comes out in docs/rendering.md.)";

std::map<std::string, pt::Layer> layer_names() {
  std::map<std::string, pt::Layer> names;
  for (const pt::LayerInfo& layer : pt::all_layers()) names[layer.name] = layer.layer;
  return names;
}

pt::LayerSet layer_set(const Options& options) {
  if (options.view) return {*options.view};
  if (options.layers.empty()) return {pt::Layer::beauty};
  pt::LayerSet layers;
  for (const std::string& name : options.layers) {
    for (const pt::LayerInfo& layer : pt::all_layers()) {
      if (name == "all" || name == layer.name) layers.add(layer.layer);
    }
  }
  return layers;
}

pt::Window crop_window(const std::vector<int>& crop, const pt::RenderSettings& settings) {
  if (crop.empty()) return {};
  const pt::Window window{crop[0], crop[1], crop[2], crop[3]};
  if (window.empty() || window.x0 < 0 || window.y0 < 0 || window.x1 > settings.width ||
      window.y1 > settings.height) {
    throw std::runtime_error(
        fmt::format("--crop: found {},{},{},{}, expected x0 < x1 and y0 < y1 in a picture of {} x "
                    "{} pixels",
                    window.x0, window.y0, window.x1, window.y1, settings.width, settings.height));
  }
  return window;
}

void add_picture_options(CLI::App& app, Options& options) {
  app.add_option("--spp", options.samples, "Samples per pixel; with --noise at most")
      ->check(CLI::Range(1, 1 << 20));
  app.add_option("--size", options.size, "Width and height in pixels")
      ->delimiter(',')
      ->expected(2)
      ->check(CLI::Range(1, 32768))
      ->option_text("W,H");
  app.add_option("--crop", options.crop, "Only pixels x0 <= x < x1, y0 <= y < y1 of the picture")
      ->delimiter(',')
      ->expected(4)
      ->option_text("X0,Y0,X1,Y1");
  app.add_option(
         "--noise", options.noise,
         "Relative error, 0.01 say, at which a part of the picture gets no more samples; 0: "
         "all get as many")
      ->check(CLI::Range(0.0, 1e3));
  app.add_option("--seed", options.seed, "Which noise the picture has");
  app.add_option(
         "--texture-filter", options.texture_filter,
         "What a sample takes of a solid texture: footprint, anisotropic, stochastic or none")
      ->transform(CLI::CheckedTransformer(pt::texture_filters()));
}

void add_output_options(CLI::App& app, Options& options) {
  auto layers = layer_names();
  CLI::Option* view = app.add_option("--view", options.view, "Show this layer instead of the light")
                          ->transform(CLI::CheckedTransformer(layers))
                          ->option_text("LAYER");
  std::vector<std::string> names{"all"};
  for (const pt::LayerInfo& layer : pt::all_layers()) names.push_back(layer.name);
  app.add_option("--layers", options.layers,
                 fmt::format("Layers of an EXR: {}", fmt::join(names, ", ")))
      ->delimiter(',')
      ->check(CLI::IsMember(names))
      ->excludes(view)
      ->option_text("LAYER,...");
  app.add_option("--view-transform", options.view_transform,
                 "How a PNG shows light: srgb, filmic, aces or false-color")
      ->transform(CLI::CheckedTransformer(pt::view_transforms()));
  app.add_option("--exposure", options.exposure, "Stops by which a PNG is brightened")
      ->check(CLI::Range(-30.0f, 30.0f));
}

void add_long_render_options(CLI::App& app, Options& options) {
  const auto seconds = CLI::Range(0.1, 1e6);
  app.add_option("--preview-every", options.preview_every,
                 "Write what there is to OUTPUT.preview.png every so many seconds")
      ->check(seconds)
      ->option_text("SECONDS");
  CLI::Option* checkpoint =
      app.add_option("--checkpoint", options.checkpoint,
                     "Keep the state of the render in this file, and go on from it if it is there")
          ->option_text("FILE");
  app.add_option("--checkpoint-every", options.checkpoint_every,
                 "Seconds between checkpoints, 60 if not said otherwise")
      ->check(seconds)
      ->needs(checkpoint)
      ->option_text("SECONDS");
}

void add_sequence_options(CLI::App& app, Options& options) {
  app.add_option("--frames", options.frames,
                 "Frames of the scene's animation, 12 or 0-47 (default: all, if OUTPUT has ####)")
      ->option_text("FIRST-LAST");
  app.add_option("--turntable", options.turntable,
                 "So many frames of the camera going round what it looks at")
      ->check(CLI::Range(1, 100000))
      ->option_text("FRAMES");
  CLI::Option* force = app.add_flag("--force", options.force, "Overwrite pictures that exist");
  app.add_flag("--resume", options.resume, "Leave frames out whose pictures exist")
      ->excludes(force);
}

}  // namespace

void add_options(CLI::App& app, Options& options) {
  app.add_option("scene", options.scene, "Scene file (JSON)")->required()->option_text("SCENE");
  app.add_option("-o,--output", options.output,
                 "Picture to write, .exr or .png; #### is the number of the frame")
      ->required();
  add_picture_options(app, options);
  add_output_options(app, options);
  add_long_render_options(app, options);
  add_sequence_options(app, options);
  app.add_option("--threads", options.threads, "Threads (default: all)")
      ->check(CLI::Range(1, 1024));
  app.add_flag("--stats", options.stats, "Say where the time went, and what it bought");
  app.add_flag("--quiet", options.quiet, "Say nothing but errors");
  app.footer(kExamples);
}

pt::RenderSettings settings_for(const pt::Scene& scene, const Options& options) {
  pt::RenderSettings settings = pt::settings_of(scene);
  if (!options.size.empty()) {
    settings.width = options.size[0];
    settings.height = options.size[1];
  }
  if (options.samples) settings.samples = *options.samples;
  if (options.noise) settings.noise = *options.noise;
  if (options.seed) settings.seed = *options.seed;
  if (options.texture_filter) settings.texture_filter = *options.texture_filter;
  settings.threads = options.threads;
  settings.crop = crop_window(options.crop, settings);
  settings.layers = layer_set(options);
  settings.progressive = options.preview_every > 0;
  return settings;
}

pt::Display display_for(const pt::Scene& scene, const Options& options) {
  pt::Display display = pt::display_of(scene);
  if (options.view_transform) display.transform = *options.view_transform;
  if (options.exposure) display.exposure = *options.exposure;
  return display;
}

}  // namespace solidtex::tools
