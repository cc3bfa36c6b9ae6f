// What solidtex-info says about a model, as JSON and as text.
#pragma once

#include <nlohmann/json.hpp>
#include <ostream>
#include <solidtex/solidtex.hpp>
#include <string>

namespace solidtex::tools {

// Everything known about an open model; evaluates one voxel and throws when it is not finite.
nlohmann::ordered_json describe(const solidtex::texture& texture);

// JSON text; paths that are no UTF-8 do not stop it. No indent (-1): one line.
std::string to_text(const nlohmann::ordered_json& value, int indent);

// The same for people.
void print(const nlohmann::ordered_json& report, std::ostream& out);

}  // namespace solidtex::tools
