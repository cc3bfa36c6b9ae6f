// Adaptive sampling: decides when a part of the image has enough samples.
#pragma once

#include <algorithm>
#include <solidtex/pathtracer.hpp>

#include "plugins/pathtracer/film/framebuffer.h"

namespace solidtex::pathtracer {

inline constexpr int kTileSize = 32;  // pixels a side

// The error is estimated in blocks. Estimates of single pixels are too noisy: a pixel that has not
// hit a small bright emitter yet would look finished and stay too dark.
inline constexpr int kBlockSize = 8;              // divides kTileSize
inline constexpr std::uint32_t kMinSamples = 32;  // before the first error estimate
inline constexpr std::uint32_t kCheckInterval = 16;

// Side of the parts whose pixels have equal sample counts: tiles, or blocks with a noise target.
int part_size(const RenderSettings& settings);

// Depends only on the part's own samples, at fixed counts, so that the result depends on neither
// threads nor stops.
bool is_done(const Framebuffer& framebuffer, const RenderSettings& settings, const Window& part);

// Samples until the next error estimate.
std::uint32_t samples_to_check(const RenderSettings& settings, std::uint32_t count);

// Upper bound of the samples that `window` still needs. The window is aligned to parts.
std::uint64_t remaining_samples(const Framebuffer& framebuffer, const RenderSettings& settings,
                                const Window& window);

// Visits the squares of a fixed grid over the image, clipped to the window.
template <class Visit>
void for_each_square(const Window& window, int size, Visit visit) {
  for (int y = window.y0 / size * size; y < window.y1; y += size) {
    for (int x = window.x0 / size * size; x < window.x1; x += size) {
      visit(Window{std::max(x, window.x0), std::max(y, window.y0), std::min(x + size, window.x1),
                   std::min(y + size, window.y1)});
    }
  }
}

}  // namespace solidtex::pathtracer
