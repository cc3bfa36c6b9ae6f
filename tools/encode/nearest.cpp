#include "tools/encode/nearest.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace solidtex::tools {
namespace {

using Code = std::vector<float>;

double distance(const Code& a, const Code& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (double{a[i]} - b[i]) * (double{a[i]} - b[i]);
  return std::sqrt(sum);
}

// Returns each code's distance to the nearest other one.
std::vector<double> nearest_distances(const std::vector<Code>& codes) {
  std::vector<double> result(codes.size(), std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < codes.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) {
      const double d = distance(codes[i], codes[k]);
      result[i] = std::min(result[i], d);
      result[k] = std::min(result[k], d);
    }
  return result;
}

}  // namespace

Nearest find_nearest(const solidtex::space& space, const std::vector<float>& code) {
  std::vector<Code> codes;
  for (std::size_t i = 0; i < space.photograph_count(); ++i)
    codes.push_back(space.photograph(i).code);
  const auto nearest =
      std::ranges::min_element(codes, {}, [&](const Code& one) { return distance(one, code); });
  Nearest result{space.photograph_name(static_cast<std::size_t>(nearest - codes.begin())),
                 distance(*nearest, code)};
  std::vector<double> own = nearest_distances(codes);
  const auto farther = std::ranges::count_if(own, [&](double d) { return d > result.distance; });
  result.share_farther = static_cast<double>(farther) / static_cast<double>(own.size());
  const auto middle = own.begin() + static_cast<std::ptrdiff_t>(own.size() / 2);
  std::ranges::nth_element(own, middle);
  result.own_median = *middle;
  return result;
}

}  // namespace solidtex::tools
