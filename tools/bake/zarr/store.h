// Folder of a Zarr store, version 3: an OME-Zarr image with levels of detail.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tools/bake/output.h"
#include "tools/bake/zarr/layout.h"

namespace solidtex::tools {

// Name of a type in Zarr's metadata.
const char* data_type(Depth depth);

// Creates the folder and its metadata, or checks that an existing one is a bake with the same
// `identity`, the settings that its bytes depend on. Throws with the first difference.
void open_store(const std::filesystem::path& folder, const Output& output, const Volume& volume,
                const StoreLayout& layout, const nlohmann::ordered_json& identity);

}  // namespace solidtex::tools
