// solidtex-bake: evaluates a model in a box of voxels or on a mesh, and writes the result to a
// file.
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <stdexcept>
#include <utility>
#include <vector>

#include "tools/bake/channels.h"
#include "tools/bake/mesh_job.h"
#include "tools/bake/options.h"
#include "tools/bake/output.h"
#include "tools/bake/pieces.h"
#include "tools/bake/preview.h"
#include "tools/bake/sink.h"
#include "tools/bake/zarr/bake_store.h"
#include "tools/common/cli.h"
#include "tools/common/output_file.h"
#include "tools/common/progress.h"

namespace {

namespace fs = std::filesystem;
using namespace solidtex::tools;

// With --force a folder is replaced only where it is empty, and a file by no folder.
void refuse_existing(const fs::path& path, bool takes_folder, bool force) {
  std::error_code ignored;
  if (takes_folder && fs::exists(path, ignored) && !fs::is_directory(path, ignored))
    throw std::runtime_error(path.string() +
                             ": exists already as a file, expected the name of a new folder");
  const bool is_empty_folder =
      force && fs::is_directory(path, ignored) && fs::is_empty(path, ignored);
  if (!is_empty_folder || !takes_folder) refuse_overwrite(path, force);
}

void check_targets(const BakeOptions& options) {
  if (options.output.empty() && options.preview.empty()) {
    throw std::runtime_error("nothing to write: give -o OUT or --preview FILE.png (see --help)");
  }
  const bool is_mesh = !options.mesh.empty();
  const bool is_volume = !options.output.empty() && !is_mesh;
  const bool takes_folder =
      is_mesh ? !options.maps.empty() : is_volume && !*format_of(options.request()).extension;
  const bool grows = is_store(options);  // shard by shard; other outputs appear complete or not
  check_store_options(options);
  std::vector<fs::path> targets;
  if (is_volume) targets = companions(options.request());
  if (!options.output.empty() && !grows) targets.push_back(options.output);
  if (!options.preview.empty()) targets.push_back(options.preview);
  for (const fs::path& path : targets)
    refuse_existing(path, takes_folder && path == options.output, options.force);
  if (is_mesh) check_mesh_options(options);
  if (!options.preview.empty() && lower_extension(options.preview) != ".png") {
    throw std::runtime_error("--preview " + options.preview.string() +
                             ": expected a name that ends in .png");
  }
  for (const fs::path& path : targets) check_writable(path);
}

// The extension that --format or --to ask for; empty: none.
std::string extension_of(const BakeOptions& options) {
  if (options.to == "uv") return ".exr";
  if (options.to == "vertex-color") return ".ply";
  if (options.to == "volume" && options.format.empty()) return ".vdb";
  for (const Format& format : formats())
    if (options.format == format.name) return format.extension;
  return "";
}

bool makes_one_file(const BakeOptions& options) {
  if (!options.mesh.empty()) return options.maps.empty() || options.output.extension() == ".glb";
  if (is_store(options) || !*format_of(options.request()).extension) return false;
  return companions(options.request()).empty();
}

// With --format alone: the model's name and the format's extension, in the current folder.
void name_output(BakeOptions& options) {
  // The shell's completion ends the name of a folder with a slash.
  if (!options.output.has_filename() && lower_extension(options.output.parent_path()) == ".zarr")
    options.output = options.output.parent_path();
  const std::string name = fs::path(options.model).stem().string() + extension_of(options);
  if (options.output.empty() && !options.format.empty()) options.output = name;
  if (pipe_output(options.output, name) && !makes_one_file(options))
    throw CLI::ValidationError("-o", "found - for several files, expected a file or folder");
}

void bake_volume(const Output& output, const BakeOptions& options, const Volume& volume,
                 const fs::path& file) {
  Progress progress("Baking " + volume.texture.name(), voxel_count(volume.size));
  const auto sink = make_sink(file, output, volume);
  Index3 largest = choose_piece(volume, sink->depth());
  if (options.block)
    largest = {options.block, options.block, std::min(options.block, sink->depth())};
  for_each_piece(volume, largest, progress, [&](Piece piece) {
    std::vector<float> labeled;
    if (!output.phases.empty()) {
      labeled = with_labels(piece.values, volume.channels(), output.phases);
      piece.values = labeled;
    }
    sink->take(piece);
  });
  sink->finish();
  progress.finish();
}

void write_volume(const BakeOptions& options, const Volume& volume) {
  const Output output = resolve_output(options.request(), volume.texture);
  check_range(volume);
  check_room(output, volume, options.block);
  write_completely(options.output,
                   [&](const fs::path& file) { bake_volume(output, options, volume, file); });
}

void write_output(const BakeOptions& options, const Volume& volume) {
  if (is_store(options))
    bake_store(options, volume);
  else if (options.mesh.empty())
    write_volume(options, volume);
  else
    write_completely(options.output,
                     [&](const fs::path& file) { bake_mesh(options, volume.texture, file); });
  std::error_code ignored;
  if (!options.checkpoint.empty()) fs::remove(options.checkpoint, ignored);
  report_file(options.output);
}

void write_preview(const BakeOptions& options, const Volume& volume) {
  check_range(volume);
  write_completely(options.preview,
                   [&](const fs::path& file) { write_preview(file, volume, options.show); });
  report_file(options.preview);
}

std::uint64_t period_of(const Index3& size) {
  if (size[0] != size[1] || size[0] != size[2])
    throw std::runtime_error("--periodic: found --size " + std::to_string(size[0]) + "," +
                             std::to_string(size[1]) + "," + std::to_string(size[2]) +
                             ", expected a cube, such as --size " + std::to_string(size[0]));
  return static_cast<std::uint64_t>(size[0]);
}

// The engine names its parameters, the message the options as well.
solidtex::texture open_texture(const BakeOptions& options, solidtex::options chosen) {
  try {
    if (options.is_periodic) chosen.period = period_of(options.size);
    return solidtex::texture(options.model, std::move(chosen));
  } catch (const solidtex::error& error) {
    if (!options.is_periodic || error.status() != SOLIDTEX_INVALID_ARGUMENT) throw;
    throw std::runtime_error("--periodic with --size " + std::to_string(options.size[0]) + ": " +
                             error.what());
  }
}

void run(BakeOptions& options) {
  install_interrupt_handler();
  name_output(options);
  check_targets(options);
  const int threads = options.threads ? options.threads : tbb::info::default_concurrency();
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
  solidtex::options chosen{.seed = options.seed, .precision = options.precision};
  // Ctrl-C also stops the queries of a mesh and of a store, which may be long. Those of a volume
  // are short.
  if (!options.mesh.empty() || is_store(options))
    chosen.progress_callback = [](double) { return interrupted(); };
  const solidtex::texture texture = open_texture(options, std::move(chosen));
  const Volume volume{texture, options.origin, options.size};
  channel_group(texture, options.show);  // refuses a wrong name before anything is written

  tbb::task_arena(threads).execute([&] {
    if (!options.output.empty()) write_output(options, volume);
    if (!options.preview.empty()) write_preview(options, volume);
  });
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Bakes a solid texture to voxels, or onto a mesh.", "solidtex-bake");
  BakeOptions options;
  add_options(app, options);
  return run_tool(app, argc, argv, [&] { run(options); });
}
