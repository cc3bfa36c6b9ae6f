// The report of solidtex-info, as JSON and as text.
#pragma once

#include <nlohmann/json.hpp>
#include <ostream>
#include <solidtex/solidtex.hpp>
#include <string>

namespace solidtex::tools {

// The report on an open model. Evaluates one voxel and throws when it is not finite.
nlohmann::ordered_json describe(const solidtex::texture& texture);

// The report on a texture space. Decodes the first training photograph and evaluates one voxel.
nlohmann::ordered_json describe(const solidtex::space& space);

// JSON text, in one line where `indent` is -1. Bytes that are not UTF-8 are replaced.
std::string to_text(const nlohmann::ordered_json& value, int indent);

// Prints the report for people, on one screen; `is_verbose` adds all layers and all settings of
// the training.
void print(const nlohmann::ordered_json& report, std::ostream& out, bool is_verbose);

}  // namespace solidtex::tools
