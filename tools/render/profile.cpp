#include "tools/render/profile.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <chrono>

namespace solidtex::tools {
namespace {

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

rusage usage() {
  rusage result{};
  getrusage(RUSAGE_SELF, &result);
  return result;
}

double processor_seconds() {
  const rusage used = usage();
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

void print_part(const char* name, double part, double total) {
  fmt::print("  {:<14}{:>9.2f} s {:>5.1f} %\n", name, part, total > 0 ? 100 * part / total : 0);
}

double per_second(double count, double time) { return time > 0 ? count / time * 1e-6 : 0; }

}  // namespace

Profile::Profile(std::uint64_t samples)
    : samples_(static_cast<double>(samples)),
      wall_(wall_seconds()),
      processor_(processor_seconds()) {}

void Profile::print(const pathtracer::Scene& scene,
                    const pathtracer::RenderStatistics& statistics) const {
  const double wall = wall_seconds() - wall_, processor = processor_seconds() - processor_;
  const double known =
      statistics.intersection_seconds + statistics.texture_seconds + statistics.shading_seconds;
  fmt::print("rendering: {:.2f} s, {:.2f} s of processor time\n", wall, processor);
  print_part("intersection", statistics.intersection_seconds, processor);
  print_part("textures", statistics.texture_seconds, processor);
  print_part("shading", statistics.shading_seconds, processor);
  print_part("other", processor - known, processor);  // helpers of a texture, previews
  fmt::print("samples: {:.3f} million, {:.3f} million a second, {:.3f} a processor second\n",
             samples_ * 1e-6, per_second(samples_, wall), per_second(samples_, processor));
  const auto rays = static_cast<double>(statistics.ray_count);
  fmt::print("rays: {:.2f} million, {:.2f} million a second of intersection\n", rays * 1e-6,
             per_second(rays, statistics.intersection_seconds));
  const auto points = static_cast<double>(statistics.texture_point_count);
  fmt::print("texture points: {:.2f} million, {:.3f} million a second of textures\n", points * 1e-6,
             per_second(points, statistics.texture_seconds));
  const pathtracer::BrickStatistics bricks = pathtracer::brick_statistics(scene);
  fmt::print("bricks: {} computed, {} needed by what is seen, {:.1f} MiB at most\n",
             bricks.computed, bricks.needed, static_cast<double>(bricks.peak_bytes) / 0x1p20);
  fmt::print("memory: {:.1f} MiB at most\n", static_cast<double>(usage().ru_maxrss) / 1024);
}

}  // namespace solidtex::tools
