// JSON written as text. A tree of nlohmann-json takes memory to be destroyed, and ends the process
// or leaks where there is none.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace solidtex::engine {

// Returns the text of a number or a string.
template <class Value>
std::string scalar_text(const Value& value) {
  return nlohmann::json(value).dump();
}

// Returns the text of an array whose elements have the texts text(element).
template <class Elements, class Text>
std::string array_text(const Elements& elements, const Text& text) {
  std::string result = "[";
  for (const auto& element : elements) {
    if (result.size() > 1) result += ',';
    result += text(element);
  }
  return result += ']';
}

template <class Elements>
std::string array_text(const Elements& elements) {
  return array_text(elements, [](const auto& element) { return scalar_text(element); });
}

// An object, in the order in which its members are added.
class ObjectText {
 public:
  // `json` is the text of the value.
  ObjectText& add_text(const std::string& key, const std::string& json) {
    if (!members_.empty()) members_ += ',';
    members_ += scalar_text(key) + ':' + json;
    return *this;
  }
  template <class Value>
  ObjectText& add(const std::string& key, const Value& value) {
    return add_text(key, scalar_text(value));
  }
  std::string text() const { return '{' + members_ + '}'; }

 private:
  std::string members_;
};

}  // namespace solidtex::engine
