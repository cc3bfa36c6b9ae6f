// Validates scene files against the JSON schema.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace solidtex::pathtracer {

// The text of scene.schema.json, compiled into the library.
const char* scene_schema_text();

// Throws SceneError "file: /json/path: found ..., expected ..." for a violation of the schema. The
// expectation is the schema's description of the place.
void check_scene_schema(const nlohmann::json& document, const std::string& file);

// Returns the JSON text of a value, shortened for messages.
std::string quote_json(const nlohmann::json& value);

[[noreturn]] void refuse_json(const std::string& file, const nlohmann::json::json_pointer& place,
                              const std::string& found, const std::string& expected);

}  // namespace solidtex::pathtracer
