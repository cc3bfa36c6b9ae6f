// A render's state as a file: a line with the file type, a line of JSON that identifies the render,
// then the framebuffer's arrays as in memory.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "plugins/pathtracer/film/framebuffer.h"
#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {

// Everything that must be equal for a resumed render to give the same bits.
nlohmann::json identity_of(const Scene& scene, const RenderSettings& settings);

void write_checkpoint(const std::filesystem::path& file, const nlohmann::json& identity,
                      const RenderStatistics& statistics, Framebuffer& framebuffer);

// Throws std::runtime_error if the file is damaged or belongs to another render, naming the
// difference. The framebuffer is then unchanged.
RenderStatistics read_checkpoint(const std::filesystem::path& file, const nlohmann::json& identity,
                                 Framebuffer& framebuffer);

}  // namespace solidtex::pathtracer
