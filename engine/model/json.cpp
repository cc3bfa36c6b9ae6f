// Strict JSON with nlohmann-json, which by itself accepts duplicate keys and any depth.
#include <algorithm>

#include "engine/model/checks.h"

namespace solidtex::engine {
namespace {

using nlohmann::json;

constexpr std::size_t max_depth = 32;
constexpr std::size_t max_explanation = 200;

// Makes the parser's quotation of the input, which may be long and binary, fit for a message.
std::string printable(std::string text) {
  text = text.substr(0, max_explanation);
  std::ranges::replace_if(
      text, [](unsigned char byte) { return byte < 0x20 || byte > 0x7E; }, '?');
  return text;
}

// Takes what the parser reads, value by value, to its place below `root`.
class Builder : public nlohmann::json_sax<json> {
 public:
  Builder(const std::string& label, const std::string& what, json& root)
      : label_(label), what_(what), root_(root) {}

  bool null() override { return add(nullptr); }
  bool boolean(bool value) override { return add(value); }
  bool number_integer(number_integer_t value) override { return add(value); }
  bool number_unsigned(number_unsigned_t value) override { return add(value); }
  bool number_float(number_float_t value, const string_t&) override { return add(value); }
  bool string(string_t& value) override { return add(std::move(value)); }
  bool binary(binary_t&) override { return false; }  // no JSON text has any
  bool start_object(std::size_t) override { return open(json::value_t::object); }
  bool start_array(std::size_t) override { return open(json::value_t::array); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }

  bool key(string_t& key) override {
    const auto [member, is_new] = open_.back()->get_ref<json::object_t&>().try_emplace(key);
    if (!is_new)
      throw invalid(label_, what_, "key " + show(key) + " twice in one object", "unique keys");
    member_ = &member->second;
    return true;
  }

  bool parse_error(std::size_t, const std::string&, const json::exception& error) override {
    throw Error(SOLIDTEX_INVALID_MODEL,
                label_ + ": " + what_ + ": found invalid JSON (" + printable(error.what()) + ")");
  }

 private:
  json& place(json&& value) {
    if (open_.empty()) return root_ = std::move(value);
    if (!open_.back()->is_array()) return *member_ = std::move(value);
    return open_.back()->get_ref<json::array_t&>().emplace_back(std::move(value));
  }
  bool add(json value) {
    place(std::move(value));
    return true;
  }
  bool open(json::value_t type) {
    if (open_.size() == max_depth)
      throw invalid(label_, what_, "deeply nested JSON",
                    "a depth of at most " + std::to_string(max_depth));
    open_.push_back(&place(type));
    return true;
  }
  bool close() {
    open_.pop_back();
    return true;
  }

  const std::string &label_, &what_;
  json& root_;
  std::vector<json*> open_;  // objects and arrays around the next value
  json* member_ = nullptr;   // of an object, for the next value
};

// Empties a value from within.
void clear(json& value) noexcept {
  if (auto* members = value.get_ptr<json::object_t*>()) {
    for (auto& member : *members) clear(member.second);
    members->clear();
  } else if (auto* elements = value.get_ptr<json::array_t*>()) {
    for (json& element : *elements) clear(element);
    elements->clear();
  }
}

}  // namespace

JsonDocument::JsonDocument(const std::string& label, const std::string& what, std::string_view text)
    : JsonDocument() {
  if (!text.starts_with('{'))
    throw invalid(label, what,
                  "text that begins \"" + printable(std::string(text.substr(0, 8))) + "\"",
                  "a JSON object, \"{\" first");
  if (text.find('\0') != text.npos)  // nlohmann-json stops here
    throw invalid(label, what, "a zero byte", "JSON text");
  Builder builder(label, what, root_);
  json::sax_parse(text, &builder);
}

JsonDocument::~JsonDocument() { clear(root_); }

}  // namespace solidtex::engine
