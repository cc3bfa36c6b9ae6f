// When a part of the picture has samples enough.
#pragma once

#include <algorithm>
#include <solidtex/pathtracer.hpp>

#include "plugins/pathtracer/film/framebuffer.h"

namespace solidtex::pathtracer {

inline constexpr int kTileSize = 32;  // pixels a side

// The error is looked at in blocks, since that of single pixels is itself too noisy: one that has
// not met the small bright thing yet that lights it would look finished, and stay too dark.
inline constexpr int kBlockSize = 8;                // divides kTileSize
inline constexpr std::uint32_t kLeastSamples = 32;  // before the error is believed
inline constexpr std::uint32_t kCheckInterval = 16;

// Parts of the picture whose pixels have equally many samples: tiles, with a noise target blocks.
int part_size(const RenderSettings& settings);

// A part's own samples decide, at counts that are fixed, so that neither threads nor stops do.
bool is_done(const Framebuffer& framebuffer, const RenderSettings& settings, const Window& part);

// Samples until the next look at the error.
std::uint32_t samples_to_check(const RenderSettings& settings, std::uint32_t count);

// The most that the pixels of `window`, which starts at a part, may still need.
std::uint64_t samples_left(const Framebuffer& framebuffer, const RenderSettings& settings,
                           const Window& window);

// Visits the squares of a fixed grid over the picture, clipped to the window.
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
