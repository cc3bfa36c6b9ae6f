// The files that solidtex-render writes.
#pragma once

#include <filesystem>
#include <functional>
#include <solidtex/pathtracer.hpp>
#include <string>

#include "tools/render/options.h"

namespace solidtex::tools {

// What can be known before any work is done. These throw, naming the file and what is wrong.
void check_output(const std::filesystem::path& output, const Options& options);
void check_checkpoint(const Options& options);
// Whether this machine's memory holds the picture, and the disk its file.
void check_room(const pathtracer::RenderSettings& settings, const std::filesystem::path& output);

// `write` gets a temporary name, which becomes the target's when it succeeds; its messages name the
// target.
void write_completely(const std::filesystem::path& target,
                      const std::function<void(const std::filesystem::path&)>& write);

// An EXR of the picture's layers, or a PNG of the first of them; complete or not at all.
// Returns what a PNG's colours stand for, where that needs words.
std::string write_picture(const pathtracer::Picture& picture, const pathtracer::Display& display,
                          const std::filesystem::path& output);

}  // namespace solidtex::tools
