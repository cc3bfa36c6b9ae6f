// Output of a query: values and their derivatives with respect to the position.
#pragma once

#include <cstddef>
#include <vector>

namespace solidtex::engine {

// Non-owning view of the output.
struct OutputView {
  OutputView(float* values_, float* gradients_ = nullptr)
      : values(values_), jacobians(gradients_) {}

  // Returns the view that begins at a value.
  OutputView from(std::size_t value) const {
    return {values + value, jacobians ? jacobians + 3 * value : nullptr};
  }
  // Calls use(array, width) for values and, if there are any, jacobians; width is floats per value.
  template <class Use>
  void for_both(const Use& use) const {
    use(&OutputView::values, std::size_t{1});
    if (jacobians) use(&OutputView::jacobians, std::size_t{3});
  }

  float* values;     // [point][channel]
  float* jacobians;  // [point][channel][3] per texel, or null
};

// Owner of an output.
class OutputBuffer {
 public:
  OutputBuffer(std::size_t values, bool with_gradients)
      : values_(values), gradients_(with_gradients ? 3 * values : 0) {}

  operator OutputView() {
    return {values_.data(), gradients_.empty() ? nullptr : gradients_.data()};
  }

  std::size_t bytes() const { return sizeof(float) * (values_.size() + gradients_.size()); }

 private:
  std::vector<float> values_, gradients_;
};

}  // namespace solidtex::engine
