// Evaluates "animation" and turntables: the scene document of a frame.
#pragma once

#include <glm/glm.hpp>
#include <nlohmann/json.hpp>
#include <string>

namespace solidtex::pathtracer {

// Throws SceneError, naming `file` and the place, for an invalid track.
void check_animation(const nlohmann::json& document, const std::string& file);

// Returns the document with the values of all tracks at a frame, which may be fractional.
nlohmann::json document_at(const nlohmann::json& document, double frame);

// Returns the document with its camera rotated about the up direction through the look-at point,
// counter-clockwise seen from above. Positions are rounded to single precision relative to
// `origin`.
nlohmann::json with_turned_camera(const nlohmann::json& document, double degrees,
                                  const glm::dvec3& origin);

}  // namespace solidtex::pathtracer
