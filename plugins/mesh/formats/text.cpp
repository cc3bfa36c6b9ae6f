#include "plugins/mesh/formats/text.h"

#include <charconv>
#include <cstdio>
#include <limits>

namespace solidtex::mesh {
namespace {

std::string_view without_plus(std::string_view word) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  return word;
}

}  // namespace

std::string_view without_bom(std::string_view text) {
  constexpr std::string_view kBom = "\xef\xbb\xbf";
  if (text.starts_with(kBom)) text.remove_prefix(kBom.size());
  return text;
}

std::string_view take_line(std::string_view& text) {
  const std::size_t end = text.find_first_of("\r\n");
  const std::string_view line = text.substr(0, end);
  if (end == std::string_view::npos) {
    text = {};
    return line;
  }
  const bool is_pair = text.substr(end).starts_with("\r\n");
  text.remove_prefix(end + (is_pair ? 2 : 1));
  return line;
}

std::string_view take_word(std::string_view& line) {
  std::size_t begin = 0;
  while (begin < line.size() && is_blank(line[begin])) ++begin;
  std::size_t end = begin;
  while (end < line.size() && !is_blank(line[end])) ++end;
  const std::string_view word = line.substr(begin, end - begin);
  line.remove_prefix(end);
  return word;
}

std::optional<double> to_number(std::string_view word) {
  word = without_plus(word);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  const std::string_view rest(end, static_cast<std::size_t>(word.data() + word.size() - end));
  if (error == std::errc::result_out_of_range && rest.empty()) {
    const bool is_tiny = word.find("e-") != word.npos || word.find("E-") != word.npos;
    return is_tiny ? 0.0 : std::numeric_limits<double>::infinity();
  }
  if (error != std::errc()) return std::nullopt;
  if (rest.starts_with('#')) return std::numeric_limits<double>::quiet_NaN();
  return rest.empty() ? std::optional(value) : std::nullopt;
}

std::optional<std::int64_t> to_integer(std::string_view word) {
  word = without_plus(word);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

std::string in_small_letters(std::string_view word) {
  std::string text(word);
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

std::string number_text(double value) {
  char digits[32];
  std::snprintf(digits, sizeof digits, "%.12g", value);
  return digits;
}

std::string quote(std::string_view word) {
  constexpr std::size_t kMax = 40;
  if (word.empty()) return "nothing";
  std::string text = "\"";
  for (const char c : word.substr(0, kMax)) text += c >= ' ' && c <= '~' ? c : '?';
  return text + (word.size() > kMax ? "...\"" : "\"");
}

}  // namespace solidtex::mesh
