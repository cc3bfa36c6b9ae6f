// How far a code lies from the materials that a space has seen.
#pragma once

#include <solidtex/solidtex.hpp>
#include <string>

namespace solidtex::tools {

struct Nearest {
  std::string name;          // of the nearest training photograph
  double distance = 0;       // to its code
  double own_median = 0;     // median distance of a training code to its nearest other
  double share_farther = 0;  // of the training codes whose nearest other is farther away

  // Farther than nine tenths of the training codes lie from each other.
  bool is_far() const { return share_farther < 0.1 && distance > own_median; }
};

Nearest find_nearest(const solidtex::space& space, const std::vector<float>& code);

}  // namespace solidtex::tools
