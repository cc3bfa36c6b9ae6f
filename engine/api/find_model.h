// From what the user calls a model to its file.
#pragma once

#include <filesystem>
#include <string>

namespace solidtex::engine {

// `model` is a path (it has a slash or ends in ".solidtex") or the bare name of a model in one of
// the model folders. Throws Error that lists the names there are and the folders searched.
std::filesystem::path find_model(const std::string& model);

}  // namespace solidtex::engine
