#include <algorithm>
#include <array>
#include <fstream>
#include <new>

#include "plugins/mesh/formats/readers.h"
#include "plugins/mesh/formats/text.h"

namespace solidtex::mesh {
namespace {

struct Format {
  std::string_view extension;
  PolygonMesh (*read)(const std::string& file, std::string_view content);
};
constexpr std::array<Format, 6> kFormats = {{{".ply", read_ply},
                                             {".obj", read_obj},
                                             {".gltf", read_gltf},
                                             {".glb", read_gltf},
                                             {".stl", read_stl},
                                             {".off", read_off}}};

const Format& format_of(const std::filesystem::path& file) {
  const std::string extension = in_small_letters(file.extension().string());
  const auto known = std::ranges::find(kFormats, extension, &Format::extension);
  if (known != kFormats.end()) return *known;
  refuse(file.string(), "a file named *" + file.extension().string(),
         std::string(kMeshFormats) + ": export it as one of these");
}

}  // namespace

std::string read_bytes(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  std::string bytes(stream ? static_cast<std::size_t>(stream.tellg()) : 0, '\0');
  stream.seekg(0);
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!stream) refuse(file.string(), "a file that cannot be read", "a mesh");
  return bytes;
}

Mesh load_mesh(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file)) {
    refuse(file.string(), "no such file", std::string("a mesh, ") + kMeshFormats);
  }
  const Format& format = format_of(file);
  try {
    return to_mesh(format.read(file.string(), read_bytes(file)));
  } catch (const std::bad_alloc&) {
    refuse(file.string(), "more than fits into memory", "a smaller mesh");
  }
}

}  // namespace solidtex::mesh
