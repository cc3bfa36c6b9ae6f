#include "plugins/pathtracer/integrator/adaptive_sampling.h"

#include <limits>

namespace solidtex::pathtracer {

int part_size(const RenderSettings& settings) {
  return settings.noise > 0 ? kBlockSize : kTileSize;
}

bool is_done(const Framebuffer& framebuffer, const RenderSettings& settings, const Window& part) {
  const std::uint32_t count = framebuffer.sample_count(framebuffer.pixel(part.x0, part.y0));
  if (count >= static_cast<std::uint32_t>(settings.samples)) return true;
  return settings.noise > 0 && count >= kMinSamples && count % kCheckInterval == 0 &&
         framebuffer.relative_error(part) <= settings.noise;
}

std::uint32_t samples_to_check(const RenderSettings& settings, std::uint32_t count) {
  return settings.noise > 0 ? kCheckInterval - count % kCheckInterval
                            : std::numeric_limits<std::uint32_t>::max();
}

std::uint64_t remaining_samples(const Framebuffer& framebuffer, const RenderSettings& settings,
                                const Window& window) {
  std::uint64_t left = 0;
  for_each_square(window, part_size(settings), [&](const Window& part) {
    if (is_done(framebuffer, settings, part)) return;
    const std::uint32_t count = framebuffer.sample_count(framebuffer.pixel(part.x0, part.y0));
    left += part.pixel_count() * (static_cast<std::uint32_t>(settings.samples) - count);
  });
  return left;
}

}  // namespace solidtex::pathtracer
