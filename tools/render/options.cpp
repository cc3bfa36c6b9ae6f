#include "tools/render/options.h"

#include <fmt/format.h>

#include <charconv>
#include <map>
#include <set>

#include "tools/common/cli.h"
#include "tools/common/output_file.h"

namespace solidtex::tools {
namespace {

namespace fs = std::filesystem;
namespace pt = solidtex::pathtracer;

constexpr const char* kExamples = R"(Examples:
  solidtex-render bust.obj --model marble -o bust.png
  solidtex-render bust.obj --model mine.solidtex --turntable 36 -o turn.####.png
  solidtex-render scenes/demo.json -o demo.png
  solidtex-render scene.json --spp 256 --size 1920,1080 -o scene.exr
  solidtex-render scene.json --spp 4 --force -o quick.png     preview
  solidtex-render scene.json --aovs all -o scene.exr          for compositing
  solidtex-render scene.json --view normal -o normal.png      show one AOV
  solidtex-render scene.json --spp 4096 --noise 0.02 --checkpoint scene.state -o scene.exr
  solidtex-render scene.json --turntable 36 -o turn.####.png

Options override the "render" settings of the scene. The same scene, size, samples and seed give the
same image, bit for bit, with any number of threads. An EXR holds linear light. A PNG applies the
exposure and the view transform. docs/scene-format.md describes scenes, docs/rendering.md images.)";

std::map<std::string, pt::Aov> aov_names() {
  std::map<std::string, pt::Aov> names;
  for (const pt::AovInfo& aov : pt::all_aovs()) names[aov.name] = aov.aov;
  return names;
}

pt::AovSet aov_set(const Options& options) {
  pt::AovSet aovs = aovs_to_write(options);
  if (options.denoise) {
    if (!aovs.has(pt::Aov::beauty)) {
      throw std::runtime_error(
          "--denoise: found --aovs without beauty, expected beauty among them: it alone is "
          "denoised");
    }
    for (const pt::Aov aov : {pt::Aov::beauty, pt::Aov::albedo, pt::Aov::normal}) aovs.add(aov);
  }
  return aovs;
}

pt::Window crop_window(const std::vector<int>& crop, const pt::RenderSettings& settings) {
  if (crop.empty()) return {};
  const pt::Window window{crop[0], crop[1], crop[2], crop[3]};
  if (window.empty() || window.x0 < 0 || window.y0 < 0 || window.x1 > settings.width ||
      window.y1 > settings.height) {
    throw std::runtime_error(fmt::format(
        "--crop: found {},{},{},{}, expected x0 < x1 and y0 < y1 in an image of {} x {} "
        "pixels",
        window.x0, window.y0, window.x1, window.y1, settings.width, settings.height));
  }
  return window;
}

constexpr char kSize[] = "W,H, for example 640,480";

CLI::Validator size_check() {
  const auto check = [is_side = in_range(1, 32768)](const std::string& text) {
    std::string side = text;
    return is_side(side).empty() ? std::string()
                                 : "found " + text + ", expected " + kSize + ", each 1 to 32768";
  };
  return CLI::Validator("").operation(check);
}

void add_image_options(CLI::App& app, Options& options) {
  app.add_option("--spp", options.samples, "Samples per pixel; the maximum with --noise")
      ->check(in_range(1, 1 << 20));
  app.add_option("--size", options.size, "Width and height in pixels")
      ->delimiter(',')
      ->expected(2)
      ->check(size_check())
      ->option_text(kSize);
  app.add_option("--crop", options.crop, "Render only the pixels x0 <= x < x1, y0 <= y < y1")
      ->delimiter(',')
      ->expected(4)
      ->option_text("X0,Y0,X1,Y1");
  app.add_option(
         "--noise", options.noise,
         "Stop sampling a block of pixels at this relative error, 0.01 for example; 0: take all "
         "samples")
      ->check(in_range(0.0, 1e3));
  const auto set_seed = [&](std::uint64_t seed) { options.seed = seed; };
  add_seed(app, "--seed", set_seed, "Random seed");
  app.add_option("--texture-filter", options.texture_filter, "Filter of solid textures")
      ->transform(one_of(pt::texture_filters()))
      ->type_name("footprint|anisotropic|stochastic|none");
}

void add_output_options(CLI::App& app, Options& options) {
  auto aovs = aov_names();
  CLI::Option* view = app.add_option("--view", options.view, "Show this AOV instead of the beauty")
                          ->transform(one_of(aovs))
                          ->option_text("AOV");
  std::vector<std::string> names{"all"};
  for (const pt::AovInfo& aov : pt::all_aovs()) names.push_back(aov.name);
  app.add_option("--aovs,--layers", options.aovs,
                 fmt::format("AOVs of an EXR: {}", fmt::join(names, ", ")))
      ->delimiter(',')
      ->check(one_of(names))
      ->excludes(view)
      ->option_text("AOV,...");
  app.add_flag("--denoise", options.denoise,
               "Denoise the beauty by Open Image Denoise; needs its library")
      ->excludes(view);
  app.add_option("--view-transform", options.view_transform, "View transform of a PNG")
      ->transform(one_of(pt::view_transforms()))
      ->type_name("srgb|filmic|aces|false-color");
  app.add_option("--exposure", options.exposure, "Exposure of a PNG in stops")
      ->check(in_range(-30.0f, 30.0f));
}

void add_long_render_options(CLI::App& app, Options& options) {
  const auto seconds = in_range(0.1, 1e6);
  app.add_option("--preview-every", options.preview_every,
                 "Write OUTPUT.preview.png at this interval")
      ->check(seconds)
      ->option_text("SECONDS");
  CLI::Option* checkpoint =
      app.add_option("--checkpoint", options.checkpoint,
                     "Save the state of the render to this file; resume from it if it exists")
          ->option_text("FILE");
  app.add_option("--checkpoint-every", options.checkpoint_every,
                 "Interval between checkpoints (default: 60)")
      ->check(seconds)
      ->needs(checkpoint)
      ->option_text("SECONDS");
}

void add_sequence_options(CLI::App& app, Options& options) {
  app.add_option("--frames", options.frames,
                 "Frames of the animation, 12 or 0-47 (default: all if OUTPUT contains #, else 0)")
      ->option_text("FIRST-LAST");
  app.add_option("--turntable", options.turntable,
                 "Render an N-frame turntable around the look-at point")
      ->check(in_range(1, 100000))
      ->option_text("N");
  CLI::Option* force = app.add_flag("--force", options.force, "Overwrite existing images");
  app.add_flag("--resume", options.resume, "Skip frames whose images exist")->excludes(force);
}

void add_mesh_options(CLI::App& app, Options& options) {
  CLI::Option* model =
      app.add_option("--model", options.model,
                     "Show the mesh SCENE in this model: a .solidtex file or a shipped name")
          ->option_text("MODEL");
  const auto set_variant = [&](std::uint64_t seed) { options.variant = seed; };
  add_seed(app, "--variant", set_variant, "Random seed of the model (default 0)")->needs(model);
  app.add_option("--texels-per-unit", options.texels_per_unit,
                 "Texels per unit of the mesh (default: 512 along its longest side)")
      ->check(in_range(1e-6, 1e6))
      ->needs(model)
      ->option_text("N");
  app.add_option("--up", options.up, "Axis of the mesh that points up (default y)")
      ->check(one_of({"y", "z"}))
      ->needs(model)
      ->option_text("y|z");
}

bool is_mesh(const fs::path& file) {
  static const std::set<std::string> extensions = {".ply", ".obj", ".gltf", ".glb", ".stl", ".off"};
  return extensions.contains(lower_extension(file));
}

struct Range {
  int first = 0, last = 0;
};

// "12" or "0-47"
Range parse_range(const std::string& text, int frame_count) {
  Range range;
  const char* end = text.data() + text.size();
  auto parsed = std::from_chars(text.data(), end, range.first);
  range.last = range.first;
  if (parsed.ec == std::errc() && parsed.ptr != end && *parsed.ptr == '-') {
    parsed = std::from_chars(parsed.ptr + 1, end, range.last);
  }
  if (parsed.ec != std::errc() || parsed.ptr != end || range.first < 0 ||
      range.last < range.first || range.last >= frame_count) {
    throw std::runtime_error(
        fmt::format("--frames: found {}, expected FRAME or FIRST-LAST, from 0 to {}{}", text,
                    frame_count - 1, frame_count == 1 ? ": the scene has no animation" : ""));
  }
  return range;
}

}  // namespace

void add_options(CLI::App& app, Options& options) {
  app.add_option("scene", options.scene,
                 "Scene file (JSON), or with --model a mesh (*.ply, *.obj, *.gltf, *.glb, *.stl or "
                 "*.off)")
      ->required()
      ->option_text("SCENE");
  app.add_option("-o,--output", options.output,
                 "Image to write, .exr or .png; #### becomes the frame number; - (PNG) or -.exr: "
                 "standard output")
      ->required();
  add_mesh_options(app, options);
  add_image_options(app, options);
  add_output_options(app, options);
  add_long_render_options(app, options);
  add_sequence_options(app, options);
  app.add_option("--threads", options.threads, "Threads (default: all)")->check(in_range(1, 1024));
  app.add_flag("--stats", options.stats, "Print times and counts of the render");
  app.footer(kExamples);
}

pt::Sequence open_sequence(const Options& options) {
  const std::string scene = options.scene.string();
  if (options.model.empty()) {
    if (!is_mesh(options.scene)) return pt::Sequence(options.scene);
    throw std::runtime_error(scene +
                             ": found a mesh, expected a scene, or a model beside the mesh: "
                             "--model marble");
  }
  if (!is_mesh(options.scene)) {
    const std::string ending = options.scene.extension();
    throw std::runtime_error(scene + ": found " + (ending.empty() ? "no ending" : ending) +
                             ", expected a mesh with --model (*.ply, *.obj, *.gltf, *.glb, *.stl "
                             "or *.off)");
  }
  pt::MeshScene mesh{.mesh = options.scene,
                     .model = options.model,
                     .seed = options.variant,
                     .texels_per_unit = options.texels_per_unit,
                     .z_is_up = options.up == "z"};
  const pt::RenderSettings defaults;
  mesh.aspect = options.size.empty() ? static_cast<double>(defaults.width) / defaults.height
                                     : static_cast<double>(options.size[0]) / options.size[1];
  return pt::Sequence(mesh);
}

pt::AovSet aovs_to_write(const Options& options) {
  if (options.view) return {*options.view};
  if (options.aovs.empty()) return {pt::Aov::beauty};
  pt::AovSet aovs;
  for (const std::string& name : options.aovs) {
    for (const pt::AovInfo& aov : pt::all_aovs()) {
      if (name == "all" || name == aov.name) aovs.add(aov.aov);
    }
  }
  return aovs;
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
  settings.aovs = aov_set(options);
  settings.progressive = options.preview_every > 0;
  return settings;
}

pt::Display display_for(const pt::Scene& scene, const Options& options) {
  pt::Display display = pt::display_of(scene);
  if (options.view_transform) display.transform = *options.view_transform;
  if (options.exposure) display.exposure = *options.exposure;
  return display;
}

std::vector<Frame> frames_to_render(const Options& options, int frame_count) {
  const bool is_numbered = has_number(options.output);
  Range range{0, is_numbered || options.turntable > 0 ? frame_count - 1 : 0};
  if (options.frames) range = parse_range(*options.frames, frame_count);
  if (!is_numbered && range.last > range.first) {
    throw std::runtime_error(fmt::format(
        "{}: found one name for {} frames, expected a name with a frame number, {}.####{}",
        options.output.string(), range.last - range.first + 1, options.output.stem().string(),
        options.output.extension().string()));
  }
  std::vector<Frame> frames;
  for (int number = range.first; number <= range.last; ++number) {
    const fs::path output = is_numbered ? numbered(options.output, number) : options.output;
    if (!options.resume || !fs::exists(output)) frames.push_back({number, output});
  }
  return frames;
}

}  // namespace solidtex::tools
