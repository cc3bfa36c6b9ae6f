#include "engine/model/tensor_source.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "engine/model/checks.h"

namespace solidtex::engine {

static_assert(std::endian::native == std::endian::little, "tensors are copied as they are");

Tensor TensorSource::take(const std::string& name, const std::vector<std::int64_t>& shape) {
  const std::string where = "tensor " + show(name);
  const auto entry = tensors_.find(name);
  if (entry == tensors_.end())
    throw invalid(label_, where, "nothing", "F32 of shape " + show_shape(shape));
  const TensorView& view = entry->second;
  if (view.shape != shape)
    throw invalid(label_, where, "shape " + show_shape(view.shape), "shape " + show_shape(shape));

  Tensor tensor{shape, std::vector<float>(view.bytes.size() / sizeof(float))};
  std::memcpy(tensor.values.data(), view.bytes.data(), view.bytes.size());
  const auto bad =
      std::ranges::find_if_not(tensor.values, [](float v) { return std::isfinite(v); });
  if (bad != tensor.values.end())
    throw invalid(
        label_, where,
        std::to_string(*bad) + " at element " + std::to_string(bad - tensor.values.begin()),
        "finite values");
  taken_.insert(name);
  return tensor;
}

void TensorSource::expect_all_taken() const {
  for (const auto& [name, view] : tensors_)
    if (!taken_.contains(name))
      throw invalid(label_, "tensor " + show(name), "shape " + show_shape(view.shape),
                    "no such tensor in this architecture");
}

}  // namespace solidtex::engine
