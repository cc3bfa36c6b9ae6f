// The scene file's JSON schema, enforced.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace solidtex::pathtracer {

// The text of scene.schema.json, built into the library.
const char* scene_schema_text();

// Throws SceneError "file: /json/path: found ..., expected ..." for the first place that breaks the
// schema. What was expected is the schema's own description of that place.
void check_scene_schema(const nlohmann::json& document, const std::string& file);

// How a value appears in a message: its JSON text, shortened.
std::string quote_json(const nlohmann::json& value);

[[noreturn]] void refuse_json(const std::string& file, const nlohmann::json::json_pointer& place,
                              const std::string& found, const std::string& expected);

}  // namespace solidtex::pathtracer
