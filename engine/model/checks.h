// Checked access to the JSON of a model file. A getter throws an Error that names the file, the
// field, what was found and what was expected.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/common/error.h"

namespace solidtex::engine {

inline constexpr std::int64_t max_name_bytes = 256;

// "label: where: found ..., expected ..."
Error invalid(const std::string& label, const std::string& where, const std::string& found,
              const std::string& expected);

// Returns the JSON text of a value, shortened for a message.
std::string show(const nlohmann::json& value);
std::string show_shape(const std::vector<std::int64_t>& shape);

// Returns the value if it is an integer that fits.
std::optional<std::int64_t> as_integer(const nlohmann::json& value);

// Strict JSON that begins with "{": unique keys, bounded depth. To destroy an object or array with
// members, nlohmann-json allocates memory, and ends the process if there is none. This does not.
class JsonDocument {
 public:
  JsonDocument(const std::string& label, const std::string& what, std::string_view text);
  ~JsonDocument();
  JsonDocument(const JsonDocument&) = delete;

  const nlohmann::json& root() const { return root_; }

 private:
  JsonDocument() = default;  // NOLINT(bugprone-exception-escape): null does not throw

  nlohmann::json root_;
};

// Checks a name. Names are printed and passed as C strings, so they have no control characters.
void check_name(const std::string& label, const std::string& where, const nlohmann::json& value);

// One JSON object, which must outlive this view. `where` is its path in the document, "" for the
// document itself.
class Fields {
 public:
  Fields(std::string label, std::string where, const nlohmann::json& value);

  const std::string& label() const { return label_; }
  const std::string& where() const { return where_; }
  std::string path(const std::string& key) const;
  Error wrong(const std::string& key, const std::string& expected) const;
  void allow_only(std::initializer_list<const char*> keys) const;
  bool contains(const std::string& key) const { return values_.contains(key); }

  const nlohmann::json& value(const std::string& key) const;
  std::int64_t integer(const std::string& key, std::int64_t low, std::int64_t high) const;
  double number(const std::string& key, double low, double high) const;
  std::string string(const std::string& key) const;
  std::string name(const std::string& key) const;
  std::string choice(const std::string& key, const std::vector<std::string>& choices) const;
  const nlohmann::json& array(const std::string& key, std::size_t low, std::size_t high) const;
  Fields child(const std::string& key) const;

 private:
  std::string label_, where_;
  const nlohmann::json& values_;
};

}  // namespace solidtex::engine
