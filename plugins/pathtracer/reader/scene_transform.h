// Vectors and transforms in a scene file that the schema has accepted.
#pragma once

#include <glm/glm.hpp>
#include <nlohmann/json.hpp>
#include <string>

namespace solidtex::pathtracer {

glm::dvec3 to_dvec3(const nlohmann::json& value);
glm::vec3 to_vec3(const nlohmann::json& value);

// One factor for all axes, or three.
glm::dvec3 to_scale(const nlohmann::json& value);

// The steps at `place`, the first one applied first. Throws SceneError, naming `file` and the
// place, for what flattens space and for an axis of length zero.
glm::dmat4 read_transform(const nlohmann::json& document, const nlohmann::json::json_pointer& place,
                          const std::string& file);

}  // namespace solidtex::pathtracer
