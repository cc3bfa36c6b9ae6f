#include "plugins/pathtracer/sampling/sample_sequence.h"

namespace solidtex::pathtracer {

SOLIDTEX_VECTORIZED void SamplePairs::scramble(int count) {
  for (int i = 0; i < padded_count(count); ++i) {
    const glm::vec2 pair =
        SampleSequence::pair(sample_[i], {order_[i], scramble_x_[i], scramble_y_[i]});
    x[i] = pair.x, y[i] = pair.y;
  }
}

}  // namespace solidtex::pathtracer
