// The encoder of a space in ONNX Runtime.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "engine/space/space.h"

namespace solidtex::engine {

// Any number of threads may use one encoder.
class Encoder {
 public:
  // Loads ONNX Runtime and the network. Throws Error where either is not usable.
  explicit Encoder(const Space& space);
  ~Encoder();
  Encoder(Encoder&&) noexcept;

  // Returns the code of each patch; patches [patch][channel][row][column].
  std::vector<std::vector<float>> codes(std::span<const float> patches) const;

 private:
  struct Network;
  std::unique_ptr<Network> network_;
};

}  // namespace solidtex::engine
