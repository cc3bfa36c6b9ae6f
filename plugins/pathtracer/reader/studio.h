// Default light, and the scene of a mesh without a scene file.
#pragma once

#include <nlohmann/json.hpp>
#include <solidtex/pathtracer.hpp>

namespace solidtex::pathtracer {

// Whether a scene document has objects, but neither an environment nor a light nor an emissive
// material.
bool needs_studio(const nlohmann::json& document);

// Adds a studio to a scene document without light: a gray surrounding, a large key light above the
// camera's left shoulder and a weaker one at its right. Needs a valid document.
void add_studio(nlohmann::json& document);

// Returns the scene document that shows a whole mesh. Throws MeshError and solidtex::error.
nlohmann::json document_of(const MeshScene& scene);

}  // namespace solidtex::pathtracer
