// What a render has cost, for --stats.
#pragma once

#include <cstdint>
#include <solidtex/pathtracer.hpp>

namespace solidtex::tools {

// Measures from when it is made.
class Profile {
 public:
  explicit Profile(std::uint64_t samples);  // that are going to be taken

  // Prints where the time went, what it bought, and the memory.
  void print(const pathtracer::Scene& scene, const pathtracer::RenderStatistics& statistics) const;

 private:
  double samples_, wall_, processor_;
};

}  // namespace solidtex::tools
