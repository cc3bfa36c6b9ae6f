// "animation" and turntables: what the scene file would say for one frame.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace solidtex::pathtracer {

// Throws SceneError, naming `file` and the place, when a track cannot be followed.
void check_animation(const nlohmann::json& document, const std::string& file);

// The document with the values of the tracks at this frame, which may be any number.
nlohmann::json document_at(const nlohmann::json& document, double frame);

// The document with its camera turned about the up direction through what it looks at,
// counter-clockwise seen from above.
nlohmann::json with_turned_camera(const nlohmann::json& document, double degrees);

}  // namespace solidtex::pathtracer
