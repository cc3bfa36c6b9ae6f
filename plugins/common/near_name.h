// Names that a user may have meant by one that does not exist.
#pragma once

#include <algorithm>
#include <cctype>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

namespace solidtex {

// Letters to change, add or drop until `a` is `b`; capitals count as small letters.
inline std::size_t edit_distance(const std::string& a, const std::string& b) {
  const auto small = [](char c) { return std::tolower(static_cast<unsigned char>(c)); };
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t replaced = std::exchange(row[0], i + 1);
    for (std::size_t k = 0; k < b.size(); ++k) {
      replaced += small(a[i]) == small(b[k]) ? 0 : 1;
      const std::size_t best = std::min({replaced, row[k] + 1, row[k + 1] + 1});
      replaced = std::exchange(row[k + 1], best);
    }
  }
  return row.back();
}

// Those of `names` that begin with `given`, then those that differ in at most a third of its
// letters, the nearest first; at most `count`.
inline std::vector<std::string> near_names(const std::string& given,
                                           const std::vector<std::string>& names,
                                           std::size_t count = 3) {
  std::vector<std::pair<std::size_t, std::string>> found;
  for (const std::string& name : names) {
    const bool begins = edit_distance(given, name.substr(0, given.size())) == 0;
    const std::size_t distance = begins ? 0 : edit_distance(given, name);
    if (distance <= given.size() / 3) found.emplace_back(distance, name);
  }
  std::ranges::stable_sort(found, {}, &std::pair<std::size_t, std::string>::first);
  std::vector<std::string> result;
  for (auto& [distance, name] : found)
    if (result.size() < count) result.push_back(std::move(name));
  return result;
}

}  // namespace solidtex
