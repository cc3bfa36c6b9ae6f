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

// In small letters. No mesh or image begins so.
struct OtherBeginning {
  std::string_view beginning;
  const char *found, *remedy;
};
constexpr const char* kDownload = "download the file itself, not its page";
constexpr const char* kUnpack = "unpack it first";
constexpr const char* kUtf8 = "save it as UTF-8";
constexpr std::array<OtherBeginning, 8> kOtherBeginnings = {
    {{"version https://git-lfs.github.com/spec/", "a Git LFS pointer", "run git lfs pull"},
     {"<!doctype", "an HTML page", kDownload},
     {"<html", "an HTML page", kDownload},
     {"<?xml", "an XML document", "export another format"},
     {"pk\3\4", "a ZIP archive", kUnpack},
     {"\x1f\x8b", "a gzip archive", kUnpack},
     {"\xff\xfe", "UTF-16 text", kUtf8},
     {"\xfe\xff", "UTF-16 text", kUtf8}}};

}  // namespace

std::string read_bytes(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  std::string bytes(stream ? static_cast<std::size_t>(stream.tellg()) : 0, '\0');
  stream.seekg(0);
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!stream) refuse(file.string(), "a file that cannot be read", "a mesh");
  return bytes;
}

std::optional<OtherContent> find_other_content(std::string_view content) {
  std::string begin = in_small_letters(without_bom(content).substr(0, kOtherContentSize));
  begin.erase(0, begin.find_first_not_of(" \t\r\n"));
  if (begin.empty()) return OtherContent{"an empty file", "copy or export it again"};
  for (const OtherBeginning& other : kOtherBeginnings) {
    if (begin.starts_with(other.beginning)) return OtherContent{other.found, other.remedy};
  }
  return std::nullopt;
}

Mesh load_mesh(const std::filesystem::path& file, const std::string& attribute) {
  if (!std::filesystem::is_regular_file(file)) {
    const bool is_there = std::filesystem::exists(file);
    const char* other = std::filesystem::is_directory(file) ? "a folder" : "no regular file";
    refuse(file.string(), is_there ? other : "no such file",
           std::string("a mesh, ") + kMeshFormats);
  }
  const Format& format = format_of(file);
  try {
    const std::string content = read_bytes(file);
    if (const auto other = find_other_content(content)) {
      refuse(file.string(), other->found,
             std::string("a mesh, ") + kMeshFormats + ": " + other->remedy);
    }
    if (attribute.empty()) return to_mesh(format.read(file.string(), content));
    if (format.extension != ".ply") {
      refuse(file.string(), "a " + std::string(format.extension) + " file",
             "a .ply file, whose vertices can have the attribute \"" + attribute + "\"");
    }
    return to_mesh(read_ply(file.string(), content, attribute));
  } catch (const std::bad_alloc&) {
    refuse(file.string(), "more than fits into memory", "a smaller mesh");
  }
}

}  // namespace solidtex::mesh
