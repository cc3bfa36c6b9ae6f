#include "plugins/pathtracer/sampling/numbers.h"

namespace solidtex::pathtracer {

SOLIDTEX_VECTORIZED void NumberPairs::scramble(int count) {
  for (int i = 0; i < whole_vectors(count); ++i) {
    const glm::vec2 pair = Sampler::pair(sample_[i], {order_[i], scramble_x_[i], scramble_y_[i]});
    x[i] = pair.x, y[i] = pair.y;
  }
}

}  // namespace solidtex::pathtracer
