// solidtex-bake: evaluates a model in a box of voxels or on a mesh, and writes the result to a
// file.
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <iostream>
#include <utility>

#include "tools/bake/channels.h"
#include "tools/bake/mesh_job.h"
#include "tools/bake/options.h"
#include "tools/bake/pieces.h"
#include "tools/bake/preview.h"
#include "tools/bake/sink.h"
#include "tools/common/cli.h"
#include "tools/common/output_file.h"
#include "tools/common/progress.h"

namespace {

namespace fs = std::filesystem;
using namespace solidtex::tools;

void check_targets(const BakeOptions& options) {
  if (options.output.empty() && options.preview.empty()) {
    throw std::runtime_error("nothing to write: give -o OUT or --preview FILE.png (see --help)");
  }
  for (const fs::path& path : {options.output, options.preview}) {
    if (path.empty()) continue;
    std::error_code ignored;
    const bool is_empty_folder =
        options.force && fs::is_directory(path, ignored) && fs::is_empty(path, ignored);
    const bool takes_folder = path == options.output && !options.slices.empty();
    if (!is_empty_folder || !takes_folder) refuse_overwrite(path, options.force);
  }
  if (!options.mesh.empty()) {
    check_mesh_options(options);
  } else if (!options.output.empty()) {
    output_kind(options.output, options.slices);
  }
  if (!options.preview.empty() && lower_extension(options.preview) != ".png") {
    throw std::runtime_error("--preview " + options.preview.string() +
                             ": expected a name that ends in .png");
  }
  for (const fs::path& path : {options.output, options.preview})
    if (!path.empty()) check_writable(path);
}

void bake_volume(const BakeOptions& options, const Volume& volume, const fs::path& file) {
  const OutputKind kind = output_kind(options.output, options.slices);
  check_room(kind, options.output, volume);
  Progress progress("Baking " + volume.texture.name(), voxel_count(volume.size));
  const auto sink = make_sink(kind, file, volume);
  Index3 largest = choose_piece(volume, sink->depth());
  if (options.block)
    largest = {options.block, options.block, std::min(options.block, sink->depth())};
  for_each_piece(volume, largest, progress, [&](const Piece& piece) { sink->take(piece); });
  sink->finish();
  progress.finish();
}

void write_output(const BakeOptions& options, const Volume& volume) {
  write_completely(options.output, [&](const fs::path& file) {
    if (options.mesh.empty())
      bake_volume(options, volume, file);
    else
      bake_mesh(options, volume.texture, file);
  });
  std::error_code ignored;
  if (!options.checkpoint.empty()) fs::remove(options.checkpoint, ignored);
  std::cout << options.output.string() << std::endl;
}

void write_preview(const BakeOptions& options, const Volume& volume) {
  write_completely(options.preview,
                   [&](const fs::path& file) { write_preview(file, volume, options.show); });
  std::cout << options.preview.string() << std::endl;
}

void run(const BakeOptions& options) {
  install_interrupt_handler();
  check_targets(options);
  const int threads = options.threads ? options.threads : tbb::info::default_concurrency();
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
  solidtex::options chosen{.seed = options.seed, .precision = options.precision};
  // Ctrl-C also stops the queries of a mesh, which may be long. Those of a volume are short.
  if (!options.mesh.empty()) chosen.progress_callback = [](double) { return interrupted(); };
  const solidtex::texture texture(options.model, std::move(chosen));
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
