#include "tools/bake/options.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <charconv>
#include <utility>
#include <vector>

#include "tools/common/cli.h"
#include "tools/common/output_file.h"

namespace solidtex::tools {
namespace {

std::vector<std::int64_t> integers(const std::string& text, const std::string& option,
                                   const std::string& expected) {
  std::vector<std::int64_t> values;
  const char* at = text.data();
  const char* const end = at + text.size();
  while (true) {
    std::int64_t value = 0;
    const auto [next, error] = std::from_chars(at, end, value);
    const bool good = error == std::errc() && (next == end || *next == ',');
    if (!good) {
      throw CLI::ValidationError(option, "found " + text + ", expected " + expected);
    }
    values.push_back(value);
    if (next == end) return values;
    at = next + 1;
  }
}

constexpr std::int64_t max_size = std::int64_t{1} << 20;

Index3 parse_size(const std::string& text) {
  const std::string expected = "N or X,Y,Z from 1 to " + std::to_string(max_size);
  const auto values = integers(text, "--size", expected);
  Index3 size{};
  if (values.size() == 1) size.fill(values[0]);
  if (values.size() == 3) size = {values[0], values[1], values[2]};
  for (const std::int64_t value : size) {
    if (value < 1 || value > max_size) {
      throw CLI::ValidationError("--size", "found " + text + ", expected " + expected);
    }
  }
  return size;
}

Index3 parse_origin(const std::string& text) {
  const std::string expected = "three integers X,Y,Z";
  const auto values = integers(text, "--origin", expected);
  if (values.size() != 3) {
    throw CLI::ValidationError("--origin", "found " + text + ", expected " + expected);
  }
  return {values[0], values[1], values[2]};
}

// "3/8": the third of eight parts.
void parse_part(const std::string& text, BakeOptions& options) {
  const auto slash = text.find('/');
  const auto number = [&](const std::string& digits, std::int64_t& value) {
    const char* const end = digits.data() + digits.size();
    const auto [next, error] = std::from_chars(digits.data(), end, value);
    return error == std::errc() && next == end && value >= 1;
  };
  if (slash == std::string::npos || !number(text.substr(0, slash), options.part) ||
      !number(text.substr(slash + 1), options.parts) || options.part > options.parts) {
    throw CLI::ValidationError("--shard",
                               "found " + text + ", expected I/N, one of N parts, from 1/N to N/N");
  }
}

void add_store_options(CLI::App& app, BakeOptions& options) {
  app.add_option_function<std::string>(
         "--shard", [&](const std::string& text) { parse_part(text, options); },
         "Bake only part I of N of a .zarr, such as 3/8, for a job array")
      ->type_name("I/N");
  app.add_option(
         "--shard-size", options.shard_size,
         "Voxels along the edges of a shard of a .zarr: 16, 32 ... 1024 (default: by --size)")
      ->check(one_of({"16", "32", "64", "128", "256", "512", "1024"}))
      ->type_name("N");
}

constexpr char examples[] =
    "OUT is a file whose name ends in .npy, .vdb, .nvdb, .nrrd, .nhdr, .raw, .vti, .vol, .tif,\n"
    ".dds, .ktx2, .png (a sheet of all slices) or .zarr, a new folder with --slices, or with\n"
    "--mesh a .ply, .exr, .glb, .vdb or .nvdb file or a new folder of --maps. What memory or the\n"
    "disk cannot hold is refused: .vdb, .nvdb, .dds, .ktx2 and .png need memory for the whole\n"
    "volume, --slices for a slice, --maps and .glb for all maps, the others for none.\n"
    "A .zarr is a folder with levels of detail; after an interruption the same command goes on.\n"
    "Examples:\n"
    "  solidtex-bake granite-grey --size 256 -o granite.npy\n"
    "  solidtex-bake granite-grey --size 256 --voxel-size 50um --depth 16 -o granite.nrrd\n"
    "  solidtex-bake mine.solidtex --size 512,512,64 --origin -100,0,7 --seed 3 -o mine.vdb\n"
    "  solidtex-bake rust-red --size 128 --slices png -o rust-slices\n"
    "  solidtex-bake granite-grey --size 4096 --format zarr\n"
    "  solidtex-bake rust-red --preview rust.png\n"
    "  solidtex-bake marble --mesh bust.obj --to uv --size 4096 -o bust.exr\n"
    "  solidtex-bake marble --mesh bust.obj --to vertex-color -o bust.ply\n"
    "  solidtex-bake paint-rusted --mesh bust.obj --maps albedo,roughness,height,normal -o maps\n"
    "  solidtex-bake paint-rusted --mesh bust.obj -o bust.glb\n"
    "  solidtex-bake marble --mesh bust.obj --to volume -o bust.vdb\n"
    "  solidtex-bake mine.solidtex --show roughness --preview roughness.png";

// Refuses options of a mesh that contradict each other.
void check_mesh_usage(const BakeOptions& options) {
  const bool is_glb = lower_extension(options.output) == ".glb";
  const auto refuse = [](const std::string& option, const std::string& expected) {
    throw CLI::ValidationError(option, "expected " + expected);
  };
  if (options.to.empty() && options.maps.empty() && !is_glb) {
    throw CLI::ValidationError("--mesh", "found -o " + options.output.string() +
                                             ", expected -o FILE.glb, --maps albedo -o FOLDER, "
                                             "--to uv -o FILE.exr, --to vertex-color -o FILE.ply "
                                             "or --to volume -o FILE.vdb");
  }
  if (options.normal_map == "directx") {
    if (is_glb) refuse("--normal-map directx", "opengl in a .glb: the normals of glTF point up");
    if (options.maps.empty()) throw CLI::RequiresError("--normal-map", "--maps");
  }
  if (options.to == "volume") return;
  const std::pair<const char*, std::string> volume_options[] = {
      {"--depth", options.depth},
      {"--color-space", options.color_space},
      {"--channels", options.channels}};
  for (const auto& [name, value] : volume_options)
    if (!value.empty()) refuse(name, "it with --to volume, or without --mesh");
  if (options.format.empty()) return;
  if (!options.to.empty()) refuse("--format", "it with --maps, found it with --to " + options.to);
  if (is_glb) refuse("--format", "none with a .glb, whose maps are PNG");
  if (options.format != "png" && options.format != "exr") {
    refuse("--format " + options.format, "png or exr with --maps");
  }
}

void add_mesh_options(CLI::App& app, BakeOptions& options, CLI::Option* output) {
  auto* mesh = app.add_option("--mesh", options.mesh,
                              "Bake the surface or the inside of a mesh file (OBJ, PLY ...), not "
                              "a box")
                   ->type_name("FILE")
                   ->needs(output);
  auto* to =
      app.add_option("--to", options.to,
                     "Bake colors of the vertices to a .ply, the UV atlas to an .exr, or the "
                     "inside of a closed mesh to a .vdb or .nvdb; not with --maps and OUT.glb")
          ->check(one_of({"vertex-color", "uv", "volume"}))
          ->type_name("vertex-color|uv|volume")
          ->needs(mesh);
  app.add_option("--maps", options.maps,
                 "Bake maps of the UV atlas into the folder OUT: albedo, normal (by the channel "
                 "height) and other channels")
      ->delimiter(',')
      ->type_name("NAME,...")
      ->needs(mesh)
      ->excludes(to);
  app.add_option("--normal-map", options.normal_map,
                 "Green of a normal map: up (opengl, default) or down (directx); glTF is opengl")
      ->check(one_of({"opengl", "directx"}))
      ->type_name("opengl|directx")
      ->needs(mesh);
  app.parse_complete_callback([&app, &options] {
    if (options.mesh.empty()) return;
    if (app.get_option("MODEL")->empty())
      throw CLI::ValidationError("MODEL", "found none, expected the material of --mesh " +
                                              options.mesh.string() +
                                              ": a .solidtex file or a shipped name");
    check_mesh_usage(options);
  });
  app.add_option("--relief", options.relief,
                 "Height of a normal map's relief in texels where the channel height is 1 "
                 "(default 1.5)")
      ->check(in_range(1e-3, 1e3))
      ->type_name("N")
      ->needs(mesh);
  app.add_option("--texels-per-unit", options.texels_per_unit,
                 "Texels per unit of the mesh (default: 512 along its longest side)")
      ->check(in_range(1e-9, 1e9))
      ->type_name("N")
      ->needs(mesh);
  app.add_option("--color-type", options.color_type,
                 "Type of vertex colors: uchar is sRGB-encoded, float is linear (default uchar)")
      ->check(one_of({"uchar", "float"}))
      ->type_name("uchar|float")
      ->needs(mesh);
  app.add_option("--margin", options.margin,
                 "Extend the charts of an atlas by N texels (default 8)")
      ->check(in_range(0, 64))
      ->type_name("N")
      ->needs(mesh);
  app.add_option("--checkpoint", options.checkpoint,
                 "Save the progress of a mesh to this file; continue from it if it exists")
      ->type_name("FILE")
      ->needs(mesh);
  for (const char* name :
       {"--slices", "--labels", "--voxel-size", "--block", "--periodic", "--shard", "--shard-size"})
    mesh->excludes(app.get_option(name));
}

void add_format_options(CLI::App& app, BakeOptions& options, CLI::Option* output) {
  std::vector<std::string> names;
  for (const Format& format : formats()) names.push_back(format.name);
  auto* format = app.add_option("--format", options.format,
                                fmt::format("Format of the output: {}", fmt::join(names, ", ")) +
                                    " (png and exr: slices; default: by the name of OUT); OUT may "
                                    "then be missing: MODEL with the format's extension")
                     ->check(one_of(names))
                     ->transform(format_name)
                     ->type_name("NAME");
  app.add_option("--slices", options.format, "Write a folder of images, one for each z")
      ->check(one_of({"png", "exr"}))
      ->type_name("png|exr")
      ->needs(output)
      ->excludes(format);
  app.add_option("--depth", options.depth,
                 "Type of a value: integers of 8 or 16 bits are clamped to [0, 1], half and float "
                 "are not, bc7 is compressed (default: by the format)")
      ->check(one_of({"8", "16", "half", "float", "bc7"}))
      ->type_name("8|16|half|float|bc7");
  app.add_option("--color-space", options.color_space,
                 "Encoding of colors: sRGB, linear, or the model's own (default: sRGB in integers, "
                 "model in .npy and .vdb, else linear)")
      ->check(one_of({"srgb", "linear", "model"}))
      ->type_name("srgb|linear|model");
  app.add_option("--channels", options.channels,
                 "Write one color (albedo) or channel (roughness) only (default: all)")
      ->type_name("NAME");
  auto* labels = app.add_flag("--labels", options.is_labels,
                              "Write the number of the most probable phase of a voxel in 8 bits, "
                              "0 for the first");
  for (const char* name : {"--depth", "--color-space", "--channels"})
    labels->excludes(app.get_option(name));
  app.add_option_function<std::string>(
         "--voxel-size",
         [&](const std::string& text) {
           try {
             options.voxel_size = parse_voxel_size(text);
           } catch (const std::runtime_error& error) {
             throw CLI::ValidationError(error.what());
           }
         },
         "Edges of a voxel, 2.25um or 1,1,2mm, where the format has a place for them "
         "(default: 1, without a unit)")
      ->type_name("LENGTH");
}

}  // namespace

void add_options(CLI::App& app, BakeOptions& options) {
  app.footer(examples);
  app.add_option("MODEL", options.model,
                 "Path of a .solidtex file, or name of a shipped model (default granite-grey)")
      ->type_name("");
  app.add_option_function<std::string>(
         "--size",
         [&](const std::string& text) {
           options.size = parse_size(text);
           options.has_size = true;
         },
         "Voxels along each axis (default 128), or texels along the edges of an atlas (1024)")
      ->type_name("N|X,Y,Z");
  app.add_option_function<std::string>(
         "--origin", [&](const std::string& text) { options.origin = parse_origin(text); },
         "First voxel (default 0,0,0); with --mesh, the texel of its origin")
      ->type_name("X,Y,Z");
  const auto set_seed = [&](std::uint64_t seed) { options.seed = seed; };
  add_seed(app, "--seed", set_seed, "Random seed: variant of the material (default 0)");
  app.add_flag("--periodic", options.is_periodic,
               "Let opposite faces of the cube meet (lattice family)");
  add_precision(app, options.precision);
  app.add_option(
         "--block", options.block,
         "Edge of the boxes evaluated at a time (default: chosen by memory); changes no value")
      ->check(in_range(1, 4096));
  app.add_option("--threads", options.threads, "Number of threads (default: all cores)")
      ->check(in_range(1, 1024));
  auto* output = app.add_option("-o,--output", options.output,
                                "File or folder to write; - (with --format or --to) or -.npy: "
                                "standard output")
                     ->type_name("OUT");
  add_format_options(app, options, output);
  add_store_options(app, options);
  add_mesh_options(app, options, output);
  app.add_option("--preview", options.preview,
                 "Image of a cube cut open, three slices along the axes and one at 45 degrees")
      ->type_name("FILE.png");
  app.add_option(
         "--show", options.show,
         "Channels of the preview: a color (albedo), or a single channel (roughness) in gray "
         "from 0 to 1 (default: albedo, else the first)")
      ->type_name("NAME");
  app.add_flag("--force", options.force, "Replace files that exist");
}

}  // namespace solidtex::tools
