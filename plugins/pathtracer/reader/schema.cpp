#include "plugins/pathtracer/reader/schema.h"

#include <solidtex/pathtracer.hpp>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validation_results.hpp>
#include <valijson/validator.hpp>

namespace solidtex::pathtracer {
namespace {

using nlohmann::json;
using Pointer = json::json_pointer;

constexpr std::size_t kQuoteLength = 60;

const json& schema_document() {
  static const json document = json::parse(scene_schema_text());
  return document;
}

const json& follow(const json& schema) {
  const auto reference = schema.find("$ref");
  if (reference == schema.end()) return schema;
  return follow(schema_document().at(Pointer(reference->get<std::string>().substr(1))));
}

// Returns the schema of a member of a value, or null.
const json* member_schema(const json& schema, const std::string& token, bool in_array) {
  if (in_array) return schema.contains("items") ? &follow(schema["items"]) : nullptr;
  if (schema.contains("properties") && schema["properties"].contains(token)) {
    return &follow(schema["properties"][token]);
  }
  const auto others = schema.find("additionalProperties");
  return others != schema.end() && others->is_object() ? &follow(*others) : nullptr;
}

struct Place {
  Pointer pointer;
  const json* value;
  const json* schema;
};

// valijson writes a place as "<root>", "[objects]", "[2]" ...
Place find_place(const json& document, const std::vector<std::string>& context) {
  Place place{Pointer(), &document, &schema_document()};
  for (std::size_t i = 1; i < context.size(); ++i) {
    const std::string token = context[i].substr(1, context[i].size() - 2);
    const bool in_array = place.value->is_array();
    const json* schema = member_schema(*place.schema, token, in_array);
    if (!schema) break;
    place.schema = schema;
    place.value = &place.value->at(Pointer().operator/=(token));
    place.pointer /= token;
  }
  return place;
}

std::string list_keys(const json& object) {
  std::string text;
  for (const auto& [key, unused] : object.items()) text += (text.empty() ? "" : ", ") + key;
  return text;
}

std::string description(const json& schema) {
  return schema.value("description", std::string("another value"));
}

// Keys beside which another one may stand: all of an array, or one of an "anyOf".
struct Dependency {
  std::vector<std::string> keys;
  bool needs_all = true;
};

Dependency dependency_of(const json& needed) {
  if (needed.is_array()) return {needed.get<std::vector<std::string>>()};
  Dependency result{{}, false};
  for (const json& choice : needed["anyOf"]) result.keys.push_back(choice["required"][0]);
  return result;
}

void refuse_dependency(const std::string& file, const Place& place, const std::string& key,
                       const Dependency& needed) {
  std::string missing;
  for (const std::string& other : needed.keys) {
    if (place.value->contains(other)) {
      if (!needed.needs_all) return;
      continue;
    }
    missing += (missing.empty() ? "" : needed.needs_all ? " and " : " or ") + json(other).dump();
  }
  if (missing.empty()) return;
  refuse_json(file, place.pointer / key, "a key that requires " + missing, missing + " beside it");
}

// Refuses a missing key, an unknown key, or a key without one that it depends on.
void refuse_keys(const std::string& file, const Place& place) {
  const json& value = *place.value;
  const json& schema = *place.schema;
  for (const json& key : schema.value("required", json::array())) {
    if (!value.contains(key)) {
      refuse_json(file, place.pointer, "no key " + key.dump(),
                  "the keys " + list_keys(schema["properties"]));
    }
  }
  for (const auto& [key, unused] : value.items()) {
    if (!member_schema(schema, key, false)) {
      refuse_json(file, place.pointer / key, "an unknown key",
                  "one of " + list_keys(schema["properties"]));
    }
  }
  const json dependencies = schema.value("dependencies", json::object());
  for (const auto& [key, needed] : dependencies.items()) {
    if (value.contains(key)) refuse_dependency(file, place, key, dependency_of(needed));
  }
}

}  // namespace

std::string quote_json(const json& value) {
  std::string text = value.dump();
  if (text.size() > kQuoteLength) text = text.substr(0, kQuoteLength) + "...";
  return text;
}

void refuse_json(const std::string& file, const Pointer& place, const std::string& found,
                 const std::string& expected) {
  const std::string path = place.to_string();
  throw SceneError(file + ": " + (path.empty() ? "/" : path) + ": found " + found + ", expected " +
                   expected);
}

void check_scene_schema(const json& document, const std::string& file) {
  valijson::Schema schema;
  valijson::SchemaParser().populateSchema(
      valijson::adapters::NlohmannJsonAdapter(schema_document()), schema);
  valijson::ValidationResults results;
  if (valijson::Validator().validate(schema, valijson::adapters::NlohmannJsonAdapter(document),
                                     &results)) {
    return;
  }
  // Reports the deepest place: valijson also lists all enclosing values.
  const std::vector<std::string>* deepest = nullptr;
  for (const auto& error : results) {
    if (!deepest || error.context.size() > deepest->size()) deepest = &error.context;
  }
  const Place place = find_place(document, *deepest);
  if (place.value->is_object() && place.schema->contains("properties")) refuse_keys(file, place);
  refuse_json(file, place.pointer, quote_json(*place.value), description(*place.schema));
}

}  // namespace solidtex::pathtracer
