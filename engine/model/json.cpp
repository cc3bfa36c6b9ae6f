// Strict JSON with nlohmann-json, which by itself accepts duplicate keys and any depth.
#include <algorithm>
#include <set>

#include "engine/model/checks.h"

namespace solidtex::engine {
namespace {

using nlohmann::json;

constexpr std::size_t max_depth = 32;
constexpr std::size_t max_explanation = 200;

// Follows the parser through the nesting and keeps the keys of every open object.
class Strictness {
 public:
  Strictness(const std::string& label, const std::string& what) : label_(label), what_(what) {}

  void observe(json::parse_event_t event, const json& parsed) {
    switch (event) {
      case json::parse_event_t::object_start:
      case json::parse_event_t::array_start:
        if (open_.size() == max_depth)
          throw invalid(label_, what_, "deeply nested JSON",
                        "a depth of at most " + std::to_string(max_depth));
        open_.emplace_back();
        break;
      case json::parse_event_t::object_end:
      case json::parse_event_t::array_end:
        open_.pop_back();
        break;
      case json::parse_event_t::key:
        if (!open_.back().insert(parsed.get<std::string>()).second)
          throw invalid(label_, what_, "key " + show(parsed) + " twice in one object",
                        "unique keys");
        break;
      case json::parse_event_t::value:
        break;
    }
  }

 private:
  const std::string& label_;
  const std::string& what_;
  std::vector<std::set<std::string>> open_;
};

// Makes the parser's quotation of the input, which may be long and binary, fit for a message.
std::string printable(std::string text) {
  text = text.substr(0, max_explanation);
  std::ranges::replace_if(
      text, [](unsigned char byte) { return byte < 0x20 || byte > 0x7E; }, '?');
  return text;
}

}  // namespace

json parse_json(const std::string& label, const std::string& what, std::string_view text) {
  if (!text.starts_with('{'))
    throw invalid(label, what,
                  "text that begins \"" + printable(std::string(text.substr(0, 8))) + "\"",
                  "a JSON object, \"{\" first");
  if (text.find('\0') != text.npos)  // nlohmann-json stops here
    throw invalid(label, what, "a zero byte", "JSON text");
  Strictness strictness(label, what);
  const auto observe = [&](int, json::parse_event_t event, json& parsed) {
    strictness.observe(event, parsed);
    return true;
  };
  try {
    return json::parse(text, observe);
  } catch (const json::exception& error) {
    throw Error(SOLIDTEX_INVALID_MODEL,
                label + ": " + what + ": found invalid JSON (" + printable(error.what()) + ")");
  }
}

}  // namespace solidtex::engine
