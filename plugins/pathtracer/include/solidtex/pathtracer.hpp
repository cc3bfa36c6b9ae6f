// The path tracer as a library: reads scenes and renders them. Images are in solidtex/image.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <solidtex/image.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace solidtex::pathtracer {

// A scene file, or a file it refers to, is invalid. what() names the file, the place in it, what
// was found and what was expected.
struct SceneError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Thrown by render() when Callbacks::should_stop returns true.
struct RenderStopped : std::runtime_error {
  RenderStopped() : std::runtime_error("rendering was stopped") {}
};

// Estimator of direct light. All three converge to the same image.
enum class LightSampling {
  mis,     // light and BSDF sampling, combined by multiple importance sampling
  lights,  // light sampling only
  bsdf     // BSDF sampling only
};

// Filter of solid texture look-ups. With many samples a pixel converges to the same color.
enum class TextureFilter {
  footprint,   // mean over a cube of the footprint's size
  stochastic,  // one random point of that cube
  none,        // the hit point
  anisotropic  // mean over the footprint, elongated at grazing angles
};

const std::map<std::string, TextureFilter>& texture_filters();  // by name

struct RenderSettings {
  int width = 960, height = 540;
  int samples = 64;        // per pixel; with a noise target the maximum
  std::uint64_t seed = 0;  // same seed, same bits, for any number of threads
  int threads = 0;         // 0: one per processor
  int max_depth = 12;      // segments of the longest path
  LightSampling light_sampling = LightSampling::mis;
  TextureFilter texture_filter = TextureFilter::footprint;

  AovSet aovs{Aov::beauty};  // AOVs that are not listed cost nothing
  Window crop;               // pixels to render, with the values of the full image; empty: all
  double noise = 0;  // relative error at which a block is finished; 0: all pixels get `samples`
  // Renders the first samples of all tiles before the last samples of any. The bits are the same;
  // bricks of solid textures are looked up several times.
  bool progressive = false;
};

struct RenderStatistics {
  std::uint64_t ray_count = 0;
  std::uint64_t texture_point_count = 0;   // solid texture points evaluated
  std::uint64_t invalid_sample_count = 0;  // samples that were not finite, counted as black
  // Processor time, summed over render threads. Threads that join a large texture query are not
  // counted.
  double intersection_seconds = 0, texture_seconds = 0, shading_seconds = 0;
};

struct Scene;

// Reads and checks a scene file (docs/scene-format.md) and all files it refers to. Returns the
// first frame of an animated scene.
std::shared_ptr<const Scene> load_scene(const std::filesystem::path& file);

// Bricks of the scene's solid textures since it was loaded; zeros for textures of the sampler
// family. `computed` exceeds `needed` if the cache evicted bricks.
struct BrickStatistics {
  std::uint64_t needed = 0, computed = 0, peak_bytes = 0;
};
BrickStatistics brick_statistics(const Scene& scene);

// A mesh that is shown without a scene file: the whole mesh, in a solid texture with all channels
// that a principled material knows.
struct MeshScene {
  std::filesystem::path mesh;
  std::string model;                      // a .solidtex file, or the name of a shipped model
  std::uint64_t seed = 0;                 // variant of the material
  std::optional<double> texels_per_unit;  // default: 512 texels along the longest side
  bool z_is_up = false;                   // instead of y
  double aspect = 1;                      // width of the image over its height
};

// A scene file frame by frame. A scene without light is lit by a studio, and a note says so. All
// functions throw SceneError.
class Sequence {
 public:
  explicit Sequence(const std::filesystem::path& file);
  explicit Sequence(const MeshScene& scene);
  ~Sequence();
  Sequence(const Sequence&) = delete;
  Sequence& operator=(const Sequence&) = delete;

  int frame_count() const;  // 1 for a scene without animation

  // Replaces the animation by a turntable: the first frame's camera orbits the look-at point once
  // in `frames` frames.
  void set_turntable(int frames);

  // Returns the scene at a frame, counted from 0. Valid until the next call. Loads only what
  // differs from the previous frame.
  const Scene& frame(int number);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Settings in the scene file.
RenderSettings settings_of(const Scene& scene);
Display display_of(const Scene& scene);

// Messages of loading, one line each: mesh repairs, converted images.
std::vector<std::string> notes_of(const Scene& scene);

// Called on any render thread, also on several at once.
struct Callbacks {
  // Reports samples as finished or skipped, counted since the last call.
  std::function<void(std::uint64_t)> on_samples;
  // Stops the render when it returns true.
  std::function<bool()> should_stop;
};

// Renders one image. The bits depend neither on the number of threads nor on stops.
class Renderer {
 public:
  // Keeps a reference to the scene. Throws std::invalid_argument for invalid settings.
  Renderer(const Scene& scene, const RenderSettings& settings);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  // Returns true when the image is finished, false when a callback stopped it. Call it again to
  // continue.
  bool render(const Callbacks& callbacks = {});

  std::uint64_t remaining_samples() const;
  AovImage image() const;  // of the samples so far
  RenderStatistics statistics() const;

  // Call these between calls of render(). A resumed render gives the bits of an uninterrupted one.
  // Both throw std::runtime_error, naming the file, if it cannot be written, is not a checkpoint,
  // or belongs to another scene or other settings (threads and `progressive` may differ).
  void save(const std::filesystem::path& checkpoint) const;
  void resume(const std::filesystem::path& checkpoint);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Renders the beauty.
Image render(const Scene& scene, const RenderSettings& settings, const Callbacks& callbacks = {},
             RenderStatistics* statistics = nullptr);

}  // namespace solidtex::pathtracer
