// The path tracer as a library: read a scene, render it. Pictures are in solidtex/picture.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <solidtex/picture.hpp>
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

// What a sample takes of a solid texture: the mean over a cube as large as what it sees of the
// surface, one point of that by chance, the point that the ray hits, or the mean over what it sees,
// long where it looks at a slant. The pixel converges to the same colour where samples are many.
enum class TextureFilter { footprint, stochastic, none, anisotropic };

// Their names in scene files and options.
const std::map<std::string, TextureFilter>& texture_filters();

struct RenderSettings {
  int width = 960, height = 540;
  int samples = 64;        // per pixel; with a noise target at most
  std::uint64_t seed = 0;  // same seed, same bits, whatever the number of threads
  int threads = 0;         // 0: as many as the machine has
  int max_depth = 12;      // longest path, in segments
  LightSampling light_sampling = LightSampling::mis;
  TextureFilter texture_filter = TextureFilter::footprint;

  LayerSet layers{Layer::beauty};  // what is not asked for costs nothing
  Window crop;       // the part of the picture to render, with the values of the whole; empty: all
  double noise = 0;  // relative error at which a part has samples enough; 0: all get `samples`
  // The whole picture gets its first samples before any part gets its last. Same bits, but bricks
  // of solid textures are met several times.
  bool progressive = false;
};

struct RenderStatistics {
  std::uint64_t ray_count = 0;
  std::uint64_t texture_point_count = 0;   // points asked of solid textures
  std::uint64_t invalid_sample_count = 0;  // samples that were not finite, counted as black
  // Processor time of the threads that render, all together. What other threads help with when a
  // texture is asked for much at once is not in it.
  double intersection_seconds = 0, texture_seconds = 0, shading_seconds = 0;
};

struct Scene;

// Reads and checks a scene file (docs/scene-format.md) and all it refers to. Of an animated one
// this is the first frame.
std::shared_ptr<const Scene> load_scene(const std::filesystem::path& file);

// What the bricks of the scene's solid textures have cost since it was loaded (zeros for those of
// the point family). Bricks are computed when a visible point needs one, so that `needed` is what
// the visible surface takes; more were computed if the cache had to forget some.
struct BrickStatistics {
  std::uint64_t needed = 0, computed = 0, peak_bytes = 0;
};
BrickStatistics brick_statistics(const Scene& scene);

// A scene file frame by frame. All functions throw SceneError.
class Sequence {
 public:
  explicit Sequence(const std::filesystem::path& file);
  ~Sequence();
  Sequence(const Sequence&) = delete;
  Sequence& operator=(const Sequence&) = delete;

  int frame_count() const;  // 1 for a scene that is not animated

  // From now on the frames are those of a turntable: the first one's camera goes round what it
  // looks at, once in so many frames.
  void turn(int frames);

  // The scene at a frame, counted from 0; good until the next call. What does not change between
  // frames is not loaded again.
  const Scene& frame(int number);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// What the scene file asks for.
RenderSettings settings_of(const Scene& scene);
Display display_of(const Scene& scene);

// What loading found worth saying (repaired meshes, for example), one line each.
std::vector<std::string> notes_of(const Scene& scene);

// How a host watches a render. Both may be called from any thread, and from several at once.
struct Hooks {
  // So many more samples are finished, or need not be taken.
  std::function<void(std::uint64_t)> on_samples;
  std::function<bool()> should_stop;
};

// A picture under way. It can be stopped and looked at, and goes on as if nothing had happened:
// every pixel's samples are added in their order, so that neither threads nor stops show.
class Rendering {
 public:
  // Keeps a reference to the scene. Throws std::invalid_argument for impossible settings.
  Rendering(const Scene& scene, const RenderSettings& settings);
  ~Rendering();
  Rendering(const Rendering&) = delete;
  Rendering& operator=(const Rendering&) = delete;

  // True when the picture is finished, false when it was told to stop.
  bool go_on(const Hooks& hooks = {});

  std::uint64_t samples_left() const;
  Picture picture() const;  // of the samples so far
  RenderStatistics statistics() const;

  // Between calls of go_on: writes all there is to a file, and goes on from there, with the bits of
  // a render that was never interrupted. Both throw std::runtime_error, naming the file, when it
  // cannot be written, is no checkpoint, or belongs to another scene or to other settings (threads
  // and `progressive` may change).
  void save(const std::filesystem::path& checkpoint) const;
  void resume(const std::filesystem::path& checkpoint);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// The beauty in one go.
Image render(const Scene& scene, const RenderSettings& settings, const Hooks& hooks = {},
             RenderStatistics* statistics = nullptr);

}  // namespace solidtex::pathtracer
