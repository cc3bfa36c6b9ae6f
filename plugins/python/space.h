// solidtex._engine.Space: texture spaces for Python.
#pragma once

#include <memory>
#include <vector>

#include "support.h"

// Code and colors, 12 floats or none.
struct Material {
  std::vector<float> code, colors;
};

class Space {
 public:
  explicit Space(const nb::bytes& space);

  const solidtex_space* get() const { return handle_.get(); }

 private:
  std::shared_ptr<solidtex_space> handle_;
};

void bind_space(nb::module_& m);
