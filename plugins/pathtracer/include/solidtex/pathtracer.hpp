// The path tracer as a library: read a scene, render it, write the picture.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace solidtex::pathtracer {

// A scene or a file it refers to is wrong. what() names the file, the place in it, what was found
// and what was expected.
struct SceneError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Thrown by render when Hooks::should_stop asks for it.
struct Stopped : std::runtime_error {
  Stopped() : std::runtime_error("rendering was stopped") {}
};

// How direct light is found. All three converge to the same picture.
enum class LightSampling { mis, lights, bsdf };

// What a sample takes of a solid texture: its mean over what the sample sees of the surface, one
// point of that by chance, or the point that the ray hits. The pixel converges to the same colour
// where it has many samples.
enum class TextureFilter { footprint, stochastic, none };

// Their names in scene files and options.
const std::map<std::string, TextureFilter>& texture_filters();

struct RenderSettings {
  int width = 960, height = 540;
  int samples = 64;        // per pixel
  std::uint64_t seed = 0;  // same seed, same bits, whatever the number of threads
  int threads = 0;         // 0: as many as the machine has
  int max_depth = 12;      // longest path, in segments
  LightSampling light_sampling = LightSampling::mis;
  TextureFilter texture_filter = TextureFilter::footprint;
};

// Linear RGB, row 0 on top, 3 floats a pixel.
struct Image {
  int width = 0, height = 0;
  std::vector<float> rgb;
};

struct RenderStatistics {
  std::uint64_t ray_count = 0;
  std::uint64_t texture_point_count = 0;   // points asked of solid textures
  std::uint64_t invalid_sample_count = 0;  // samples that were not finite, counted as black
};

struct Scene;

// Reads and checks a scene file (docs/scene-format.md) and all it refers to.
std::shared_ptr<const Scene> load_scene(const std::filesystem::path& file);

// The settings and the exposure that the scene file asks for.
RenderSettings settings_of(const Scene& scene);
float exposure_of(const Scene& scene);

// What loading found worth saying (repaired meshes, for example), one line each.
std::vector<std::string> notes_of(const Scene& scene);

// How a host watches a render. Both may be called from any thread, and from several at once.
struct Hooks {
  std::function<void(std::uint64_t)> on_samples;  // so many more samples are finished
  std::function<bool()> should_stop;
};

Image render(const Scene& scene, const RenderSettings& settings, const Hooks& hooks = {},
             RenderStatistics* statistics = nullptr);

// Linear EXR with 32-bit float channels R, G, B.
void write_exr(const Image& image, const std::filesystem::path& file);

// 8-bit PNG: colours times 2^exposure, clamped to [0, 1], encoded as sRGB.
void write_png(const Image& image, float exposure, const std::filesystem::path& file);

}  // namespace solidtex::pathtracer
