// A render's state as a file: one line of what it is, one of JSON that says which render it belongs
// to, then the framebuffer's arrays as they are in memory.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "plugins/pathtracer/film/framebuffer.h"
#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {

// What must be the same for a render to go on with the same bits.
nlohmann::json identity_of(const Scene& scene, const RenderSettings& settings);

void write_checkpoint(const std::filesystem::path& file, const nlohmann::json& identity,
                      const RenderStatistics& statistics, Framebuffer& framebuffer);

// Throws std::runtime_error, which says what is different, when it belongs to another render, and
// when the file is damaged; the framebuffer is unchanged then.
RenderStatistics read_checkpoint(const std::filesystem::path& file, const nlohmann::json& identity,
                                 Framebuffer& framebuffer);

}  // namespace solidtex::pathtracer
