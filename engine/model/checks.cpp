#include "engine/model/checks.h"

#include <algorithm>
#include <limits>

#include "engine/model/json_text.h"

namespace solidtex::engine {
namespace {

constexpr std::size_t max_shown = 80;

std::string join(const std::vector<std::string>& words) {
  std::string result;
  for (const std::string& word : words) result += (result.empty() ? "" : ", ") + word;
  return result;
}

// U+0000 to U+001F and U+007F to U+009F; the text is UTF-8.
bool has_control_characters(const std::string& text) {
  unsigned char before = 0;
  for (const unsigned char byte : text) {
    if (byte < 0x20 || byte == 0x7F || (before == 0xC2 && byte < 0xA0)) return true;
    before = byte;
  }
  return false;
}

}  // namespace

Error invalid(const std::string& label, const std::string& where, const std::string& found,
              const std::string& expected) {
  return Error(SOLIDTEX_INVALID_MODEL,
               label + ": " + where + ": found " + found + ", expected " + expected);
}

std::string show(const nlohmann::json& value) {
  const std::string text = value.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  return text.size() <= max_shown ? text : text.substr(0, max_shown - 3) + "...";
}

std::string show_shape(const std::vector<std::int64_t>& shape) {
  std::string result;
  for (const std::int64_t size : shape)
    result += (result.empty() ? "" : ", ") + std::to_string(size);
  return "[" + result + "]";
}

std::optional<std::int64_t> as_integer(const nlohmann::json& value) {
  if (!value.is_number_integer()) return std::nullopt;
  if (value.is_number_unsigned() &&
      value.get<std::uint64_t>() > std::numeric_limits<std::int64_t>::max())
    return std::nullopt;
  return value.get<std::int64_t>();
}

void check_name(const std::string& label, const std::string& where, const nlohmann::json& value) {
  if (value.is_string()) {
    const auto& name = value.get_ref<const std::string&>();
    if (!name.empty() && name.size() <= max_name_bytes && !has_control_characters(name)) return;
  }
  throw invalid(
      label, where, show(value),
      "a name of 1 to " + std::to_string(max_name_bytes) + " bytes without control characters");
}

Fields::Fields(std::string label, std::string where, const nlohmann::json& value)
    : label_(std::move(label)), where_(std::move(where)), values_(value) {
  if (!value.is_object())
    throw invalid(label_, where_.empty() ? "document" : where_, show(value), "an object");
}

std::string Fields::path(const std::string& key) const {
  return where_.empty() ? key : where_ + "." + key;
}

Error Fields::wrong(const std::string& key, const std::string& expected) const {
  return invalid(label_, path(key), show(values_.at(key)), expected);
}

void Fields::allow_only(std::initializer_list<const char*> keys) const {
  const std::vector<std::string> known(keys.begin(), keys.end());
  for (const auto& [key, value] : values_.items())
    if (std::ranges::find(known, key) == known.end())
      throw invalid(label_, path(key), "an unknown key", "one of " + join(known));
}

const nlohmann::json& Fields::value(const std::string& key) const {
  const auto found = values_.find(key);
  if (found == values_.end()) throw invalid(label_, path(key), "nothing", "this required key");
  return *found;
}

std::int64_t Fields::integer(const std::string& key, std::int64_t low, std::int64_t high) const {
  const auto result = as_integer(value(key));
  if (!result || *result < low || *result > high)
    throw wrong(key, "an integer from " + std::to_string(low) + " to " + std::to_string(high));
  return *result;
}

double Fields::number(const std::string& key, double low, double high) const {
  const nlohmann::json& found = value(key);
  const double result = found.is_number() ? found.get<double>() : 0;
  if (!found.is_number() || result < low || result > high)
    throw wrong(key, "a number from " + scalar_text(low) + " to " + scalar_text(high));
  return result;
}

std::string Fields::string(const std::string& key) const {
  if (!value(key).is_string()) throw wrong(key, "a string");
  return value(key).get<std::string>();
}

std::string Fields::name(const std::string& key) const {
  check_name(label_, path(key), value(key));
  return value(key).get<std::string>();
}

std::string Fields::choice(const std::string& key, const std::vector<std::string>& choices) const {
  for (const std::string& choice : choices)
    if (value(key) == choice) return choice;
  std::vector<std::string> shown;
  shown.reserve(choices.size());
  for (const std::string& choice : choices) shown.push_back(show(choice));
  throw wrong(key, "one of " + join(shown));
}

const nlohmann::json& Fields::array(const std::string& key, std::size_t low,
                                    std::size_t high) const {
  const nlohmann::json& result = value(key);
  if (!result.is_array()) throw wrong(key, "an array");
  if (result.size() < low || result.size() > high)
    throw invalid(label_, path(key), std::to_string(result.size()) + " entries",
                  std::to_string(low) + " to " + std::to_string(high) + " entries");
  return result;
}

Fields Fields::child(const std::string& key) const { return Fields(label_, path(key), value(key)); }

}  // namespace solidtex::engine
