// solidtex-bake in a process of its own, whose memory can be measured.
#include "tools/bench/cases.h"
#include "tools/bench/child.h"
#include "tools/bench/cost.h"

namespace solidtex::tools {
namespace {

Timing bake(const std::string& model, std::int64_t size, int threads, Clock clock) {
  const TemporaryFile file(".npy");
  const ChildUsage usage =
      run_child({sibling_program("solidtex-bake"), model, "--size", std::to_string(size),
                 "--threads", std::to_string(threads), "-o", file.path().string()});
  const double seconds = clock == Clock::wall ? usage.wall_seconds : usage.cpu_seconds / threads;
  return {seconds, usage.peak_resident_bytes};
}

}  // namespace

std::vector<CaseInfo> bake_cases() {
  const auto make = [](Models& models, const CaseSettings& settings) {
    const solidtex::texture& texture = models.lattice();
    const std::int64_t size = settings.quick ? 20 : settings.bake_size;
    Case made;
    made.unit = "voxel";
    made.units_per_call = static_cast<double>(size * size * size);
    made.multiply_adds_per_unit =
        direct_multiply_adds(nlohmann::json::parse(texture.metadata_json()));
    made.time_call = [path = texture.path(), size](Arena& arena, Clock clock) {
      return bake(path, size, arena.threads(), clock);
    };
    return made;
  };
  return {{.name = "bake.memory",
           .about = "solidtex-bake of a cube (--bake-size) to a temporary .npy, with its memory",
           .parallel = true,
           .usual = false,
           .once = true,
           .make = make}};
}

}  // namespace solidtex::tools
