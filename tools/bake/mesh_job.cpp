#include "tools/bake/mesh_job.h"

#include <fmt/core.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "plugins/mesh/atlas.h"
#include "plugins/mesh/fingerprint.h"
#include "plugins/mesh/vertices.h"
#include "tools/bake/channels.h"
#include "tools/bake/checkpoint.h"
#include "tools/bake/glb.h"
#include "tools/bake/image_file.h"
#include "tools/bake/maps.h"
#ifdef SOLIDTEX_HAS_OPENVDB
#include "tools/bake/mesh_volume.h"
#endif
#include "tools/bake/ply.h"
#include "tools/common/cli.h"
#include "tools/common/limits.h"
#include "tools/common/output_file.h"
#include "tools/common/progress.h"

namespace solidtex::tools {
namespace {

namespace fs = std::filesystem;
using mesh::Mesh;

constexpr std::size_t vertices_at_a_time = 4096;
constexpr int texels_at_a_time = 1 << 16;
constexpr int default_atlas_size = 1024;

std::size_t texel_count(const mesh::AtlasRegion& region) {
  return static_cast<std::size_t>(region.width()) * static_cast<std::size_t>(region.height());
}

mesh::Placement placement_of(const BakeOptions& options, const Mesh& mesh) {
  const bool is_given = options.texels_per_unit != 0;
  const mesh::Placement placement = mesh::place(
      mesh, options.origin, is_given ? std::optional(options.texels_per_unit) : std::nullopt);
  const auto note = [&](const std::string& text) {
    if (!text.empty()) say(mesh.file + ": " + text);
  };
  for (const std::string& warning : mesh.warnings) note(warning);
  note(mesh::rounding_warning(mesh, placement.texels_per_unit));
  if (!is_given) note(fmt::format("--texels-per-unit {:.6g}", placement.texels_per_unit));
  return placement;
}

int atlas_size(const BakeOptions& options) {
  if (!options.has_size) return default_atlas_size;
  const auto& [x, y, z] = options.size;
  if (x != y || y != z || x > mesh::Atlas::kMaxSize) {
    throw std::runtime_error(
        fmt::format("--size {},{},{}: expected one number up to {} with --to uv", x, y, z,
                    mesh::Atlas::kMaxSize));
  }
  return static_cast<int>(x);
}

// Settings that must be equal for a bake to continue with the same bits.
nlohmann::ordered_json identity_of(const BakeOptions& options, const Mesh& mesh,
                                   const mesh::Placement& placement,
                                   const solidtex::texture& texture) {
  Fingerprint of_model, of_mesh;
  of_model.add_content_of(texture.path());
  add(of_mesh, mesh);
  nlohmann::ordered_json identity = {
      {"version", solidtex::version()}, {"model", of_model.value()},
      {"mesh", of_mesh.value()},        {"to", options.to},
      {"origin", options.origin},       {"texels-per-unit", placement.texels_per_unit},
      {"seed", options.seed},           {"precision", options.precision}};
  if (options.precision != "full") identity["target"] = solidtex::target();
  if (options.to != "uv") return identity;
  identity["size"] = atlas_size(options);
  identity["margin"] = options.margin;
  return identity;
}

Checkpoint checkpoint_of(const BakeOptions& options, const Mesh& mesh,
                         const mesh::Placement& placement, const solidtex::texture& texture) {
  if (options.checkpoint.empty()) return {};
  return {options.checkpoint, identity_of(options, mesh, placement, texture)};
}

std::vector<float> vertex_values(const Mesh& mesh, const mesh::Placement& placement,
                                 const solidtex::texture& texture, Checkpoint finished) {
  Progress progress("Baking " + texture.name(), mesh.positions.size());
  const std::vector<float> radii = mesh::vertex_radii(mesh);
  std::vector<float> values, part;
  values.reserve(radii.size() * texture.channel_count());
  for (std::size_t first = 0; first < radii.size(); first += vertices_at_a_time) {
    throw_if_interrupted();
    const std::size_t count = std::min(vertices_at_a_time, radii.size() - first);
    part.resize(count * texture.channel_count());
    if (!finished.read(part)) {
      part = evaluate_vertices(mesh, placement, texture, first,
                               std::span(radii).subspan(first, count));
      check_values(texture, part);
      finished.append(part);
    }
    values.insert(values.end(), part.begin(), part.end());
    progress.advance(count);
  }
  progress.finish();
  return values;
}

// A color as red, green and blue; other channels as floats with their own names.
std::vector<PlyProperty> properties_of(const solidtex::texture& texture,
                                       const std::vector<float>& values, bool in_bytes) {
  const std::size_t channels = texture.channel_count();
  std::vector<PlyProperty> properties;
  for (const ChannelGroup& group : channel_groups(texture)) {
    const bool is_color = group.name == "albedo" && group.channels.size() == 3;
    for (std::size_t i = 0; i < group.channels.size(); ++i) {
      const std::size_t channel = group.channels[i];
      static constexpr const char* colors[] = {"red", "green", "blue"};
      PlyProperty property{
          is_color ? colors[i] : texture.channel_name(channel), is_color && in_bytes, {}};
      for (std::size_t at = channel; at < values.size(); at += channels) {
        property.values.push_back(property.is_byte ? display_value(values[at], group.encoding)
                                                   : light_value(values[at], group.encoding));
      }
      properties.push_back(std::move(property));
    }
  }
  return properties;
}

// Values, properties and the bytes of the file are in memory together.
void check_vertex_room(const fs::path& output, const Mesh& mesh, std::size_t channels) {
  const std::size_t floats =
      3 * mesh.positions.size() + 3 * mesh.normals.size() + 2 * mesh.uvs.size();
  const double values = static_cast<double>(mesh.positions.size() * channels);
  const double file = static_cast<double>(4 * floats + 13 * mesh.triangles.size()) + values;
  check_memory(output.string(), 2 * sizeof(float) * values + file, "--to uv writes band by band");
  check_disk(output, file, "");
  check_file_size(output, file, "");
}

void bake_vertices(const BakeOptions& options, Mesh loaded, const solidtex::texture& texture,
                   const fs::path& file) {
  const Mesh mesh = mesh::share_vertices(std::move(loaded));
  check_vertex_room(options.output, mesh, texture.channel_count());
  const mesh::Placement placement = placement_of(options, mesh);
  const std::vector<float> values =
      vertex_values(mesh, placement, texture, checkpoint_of(options, mesh, placement, texture));
  write_ply(file, mesh, properties_of(texture, values, options.color_type != "float"));
}

// Calls bake(band) for bands of rows from the top of an atlas.
void for_each_band(const std::string& label, int size,
                   const std::function<void(const mesh::AtlasRegion&)>& bake) {
  Progress progress(label, static_cast<std::uint64_t>(size) * static_cast<std::uint64_t>(size));
  const int rows = std::clamp(texels_at_a_time / size, 4, size);
  for (int y = 0; y < size; y += rows) {
    throw_if_interrupted();
    const mesh::AtlasRegion band{{0, y}, {size, std::min(y + rows, size)}};
    bake(band);
    progress.advance(texel_count(band));
  }
  progress.finish();
}

void report_overlap(const Mesh& mesh, std::size_t overlapping) {
  if (overlapping == 0) return;
  say(fmt::format("{}: {} texels lie in more than one triangle and have the color of the first",
                  mesh.file, overlapping));
}

void bake_atlas(const BakeOptions& options, Mesh loaded, const solidtex::texture& texture,
                const fs::path& file) {
  const auto mesh = std::make_shared<const Mesh>(std::move(loaded));
  const int size = atlas_size(options);
  const mesh::Placement placement = placement_of(options, *mesh);
  const mesh::Atlas atlas(mesh, placement, size, options.margin);
  Checkpoint finished = checkpoint_of(options, *mesh, placement, texture);
  const std::vector<Encoding> encodings = channel_encodings(texture);
  const bool has_colors =
      std::ranges::any_of(encodings, [](Encoding encoding) { return encoding != Encoding::data; });
  ExrFile image(file, size, size, exr_names(texture),
                has_colors ? Encoding::linear : Encoding::data);
  std::vector<float> values;
  std::size_t overlapping = 0;
  for_each_band("Baking " + texture.name(), size, [&](const mesh::AtlasRegion& band) {
    values.resize(texel_count(band) * encodings.size());
    if (!finished.read(values)) {
      atlas.evaluate(texture, band, values.data());
      check_values(texture, values);
      finished.append(values);
    }
    overlapping += atlas.overlapping_texels(band);
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = light_value(values[i], encodings[i % encodings.size()]);
    }
    image.write_rows(values.data(), band.height());
  });
  image.close();
  report_overlap(*mesh, overlapping);
}

bool is_glb(const BakeOptions& options) { return lower_extension(options.output) == ".glb"; }

// The maps of an atlas, all in memory, in a folder or in a .glb file.
void bake_maps(const BakeOptions& options, Mesh loaded, const solidtex::texture& texture,
               const fs::path& file) {
  const auto mesh = std::make_shared<const Mesh>(std::move(loaded));
  const int size = atlas_size(options);
  MapSet maps(texture, options.maps, size);
  check_memory(options.output.string(), static_cast<double>(maps.bytes()), "--size makes it less");
  const mesh::Placement placement = placement_of(options, *mesh);
  const mesh::Atlas atlas(mesh, placement, size, options.margin);
  const double relief = options.relief > 0 ? options.relief : mesh::kDefaultRelief;
  std::size_t overlapping = 0;
  for_each_band("Baking " + texture.name(), size, [&](const mesh::AtlasRegion& band) {
    maps.evaluate(atlas, texture, band, relief / placement.texels_per_unit);
    overlapping += atlas.overlapping_texels(band);
  });
  report_overlap(*mesh, overlapping);
  if (is_glb(options)) {
    write_glb(file, *mesh, maps);
  } else {
    fs::create_directory(file);
    maps.write(file, options.mesh.stem().string(), options.format == "exr",
               options.normal_map == "directx");
  }
}

#ifdef SOLIDTEX_HAS_OPENVDB
void bake_volume_inside(const BakeOptions& options, const Mesh& mesh,
                        const solidtex::texture& texture, const fs::path& file) {
  bake_inside(resolve_output(options.request(), texture), mesh, placement_of(options, mesh),
              texture, file);
}
#else
void bake_volume_inside(const BakeOptions& options, const Mesh&, const solidtex::texture&,
                        const fs::path&) {
  format_of(options.request());  // throws: no OpenVDB
}
#endif

void check_volume_options(const BakeOptions& options) {
  const FormatKind kind = format_of(options.request()).kind;
  if (kind != FormatKind::vdb && kind != FormatKind::nanovdb) {
    throw std::runtime_error(
        fmt::format("-o {}: expected a name that ends in .vdb or .nvdb with --to volume",
                    options.output.string()));
  }
  if (options.has_size)
    throw std::runtime_error("--size: found it with --to volume, expected --texels-per-unit");
  if (!options.checkpoint.empty())
    throw std::runtime_error("--checkpoint: found it with --to volume, expected --to uv");
}

// After Ctrl-C.
[[noreturn]] void stop(const BakeOptions& options) {
  if (options.checkpoint.empty()) throw Interrupted();
  throw Interrupted(options.checkpoint.string() + " keeps what is done");
}

void check_map_options(const BakeOptions& options) {
  if (!options.checkpoint.empty()) {
    throw std::runtime_error("--checkpoint: found it with maps, expected it with --to");
  }
  atlas_size(options);
}

}  // namespace

void check_mesh_options(const BakeOptions& options) {
  if (options.to.empty()) return check_map_options(options);
  if (options.to == "volume") return check_volume_options(options);
  const bool is_atlas = options.to == "uv";
  const char* extension = is_atlas ? ".exr" : ".ply";
  if (lower_extension(options.output) != extension) {
    throw std::runtime_error(fmt::format("-o {}: expected a name that ends in {} with --to {}",
                                         options.output.string(), extension, options.to));
  }
  if (!is_atlas && options.has_size) {
    throw std::runtime_error("--size: found it with --to vertex-color, expected it with --to uv");
  }
  if (is_atlas) atlas_size(options);
  const auto same_place = [](const fs::path& a, const fs::path& b) {
    return fs::weakly_canonical(fs::absolute(a)) == fs::weakly_canonical(fs::absolute(b));
  };
  if (!options.checkpoint.empty() && same_place(options.checkpoint, options.output)) {
    throw std::runtime_error(options.checkpoint.string() +
                             ": found it as --checkpoint and -o, expected two files");
  }
}

void bake_mesh(const BakeOptions& options, const solidtex::texture& texture, const fs::path& file) {
  Mesh mesh = mesh::load_mesh(options.mesh);
  try {
    if (options.to.empty()) {
      bake_maps(options, std::move(mesh), texture, file);
    } else if (options.to == "volume") {
      bake_volume_inside(options, mesh, texture, file);
    } else if (options.to == "uv") {
      bake_atlas(options, std::move(mesh), texture, file);
    } else {
      bake_vertices(options, std::move(mesh), texture, file);
    }
  } catch (const Interrupted&) {
    stop(options);
  } catch (const solidtex::error&) {
    if (interrupted()) stop(options);
    throw;
  }
}

}  // namespace solidtex::tools
