// Model files: every file is refused with an Error, or its texture can be evaluated.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "engine/common/error.h"
#include "engine/model/model.h"
#include "engine/query/texture.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace solidtex::engine;
  const std::span bytes(reinterpret_cast<const std::byte*>(data), size);
  try {
    Model model = parse_model(bytes, "fuzz");
    const std::size_t channels = model.channels.size();
    const Texture texture(std::move(model), 0, std::size_t{1} << 20, Precision::full, 1);
    const std::int64_t origin[3] = {1 << 20, -3, 0}, voxel[3] = {1, 1, 1};
    std::vector<float> values(channels);
    texture.eval_box(origin, voxel, values.data());
  } catch (const Error&) {
  }
  return 0;
}
