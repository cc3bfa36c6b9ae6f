// Where the answers to a query go: values, and how they change with the position.
#pragma once

#include <cstddef>
#include <vector>

namespace solidtex::engine {

// Somebody else's memory. Derivatives are by x, y and z, in values a texel.
struct OutputView {
  OutputView(float* values_, float* gradients_ = nullptr)
      : values(values_), jacobians(gradients_) {}

  // Those from a value on.
  OutputView from(std::size_t value) const {
    return {values + value, jacobians ? jacobians + 3 * value : nullptr};
  }
  // Calls use(array, width) for either, so many numbers for each value.
  template <class Use>
  void for_both(const Use& use) const {
    use(&OutputView::values, std::size_t{1});
    if (jacobians) use(&OutputView::jacobians, std::size_t{3});
  }

  float* values;     // [point][channel]
  float* jacobians;  // [point][channel][3], null where nobody asks
};

// Memory for some.
class OutputBuffer {
 public:
  OutputBuffer(std::size_t values, bool with_gradients)
      : values_(values), gradients_(with_gradients ? 3 * values : 0) {}

  operator OutputView() {
    return {values_.data(), gradients_.empty() ? nullptr : gradients_.data()};
  }

 private:
  std::vector<float> values_, gradients_;
};

}  // namespace solidtex::engine
