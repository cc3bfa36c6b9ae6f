// Hands out the tensors of a file: each exactly once, with the shape that the architecture needs.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "engine/model/container.h"
#include "engine/model/model.h"

namespace solidtex::engine {

class TensorSource {
 public:
  TensorSource(std::string label, const std::map<std::string, TensorView>& tensors)
      : label_(std::move(label)), tensors_(tensors) {}

  // Copies one tensor; throws when it is missing, has another shape or a value that is not finite.
  Tensor take(const std::string& name, const std::vector<std::int64_t>& shape);

  // Throws when the file has tensors that nobody took.
  void expect_all_taken() const;

 private:
  std::string label_;
  const std::map<std::string, TensorView>& tensors_;
  std::set<std::string> taken_;
};

}  // namespace solidtex::engine
