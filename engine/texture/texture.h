// The query contract behind solidtex.h: points and boxes for either family, in parallel, cached.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "engine/field/box.h"
#include "engine/model/model.h"

namespace solidtex::engine {

class Field;
class Sampler;
class BrickCache;

struct CacheStats {
  std::uint64_t hit_count = 0, miss_count = 0, resident_bytes = 0, peak_bytes = 0;
};

class Texture {
 public:
  Texture(Model model, std::uint64_t seed, std::uint64_t cache_limit_bytes);
  ~Texture();

  const Model& model() const;
  std::uint64_t seed() const;

  void eval_points(const double origin[3], const float* points, std::size_t count,
                   float* values) const;
  void eval_box(const Box& box, float* values) const;
  CacheStats cache_stats() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace solidtex::engine
