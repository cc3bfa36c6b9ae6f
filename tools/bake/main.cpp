// solidtex-bake: evaluates a box of voxels of a model, or it on a mesh, and writes it to a file.
#include <fmt/core.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <iostream>
#include <optional>
#include <utility>

#include "tools/bake/channel_groups.h"
#include "tools/bake/mesh_job.h"
#include "tools/bake/options.h"
#include "tools/bake/output_file.h"
#include "tools/bake/pieces.h"
#include "tools/bake/preview.h"
#include "tools/bake/sink.h"
#include "tools/common/atomic_file.h"
#include "tools/common/cli.h"
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
    refuse_overwrite(path, options.force);
    if (fs::is_directory(path) && !fs::is_empty(path)) {
      throw std::runtime_error(path.string() + ": a folder that holds files is never replaced");
    }
  }
  if (!options.mesh.empty()) {
    check_mesh_options(options);
  } else if (!options.output.empty()) {
    output_kind(options.output, options.slices);
  }
  if (!options.preview.empty() && options.preview.extension() != ".png") {
    throw std::runtime_error("--preview " + options.preview.string() +
                             ": expected a name that ends in .png");
  }
}

// A bake that cannot fit says so before it begins.
void check_space(const BakeOptions& options, const Volume& volume) {
  double bytes = static_cast<double>(volume.channels() * sizeof(float));
  for (const std::int64_t size : volume.size) bytes *= static_cast<double>(size);
  const fs::space_info disk = fs::space(fs::absolute(options.output).parent_path());
  const double free = static_cast<double>(disk.available);
  if (bytes <= free || disk.capacity == 0) return;  // capacity 0: not a disk, writing will tell
  constexpr double mib = 1 << 20;
  throw std::runtime_error(fmt::format("{}: needs {:.0f} MiB, {:.0f} MiB are free there",
                                       options.output.string(), bytes / mib, free / mib));
}

void bake(const BakeOptions& options, const Volume& volume, AtomicFile& file) {
  const OutputKind kind = output_kind(options.output, options.slices);
  if (kind == OutputKind::npy) check_space(options, volume);
  Progress progress("Baking " + volume.texture.name(), voxel_count(volume.size));
  const auto sink = make_sink(kind, file.temporary_path(), volume);
  Index3 largest = choose_piece(volume, sink->depth());
  if (options.block)
    largest = {options.block, options.block, std::min(options.block, sink->depth())};
  for_each_piece(volume, largest, progress, [&](const Piece& piece) { sink->take(piece); });
  sink->finish();
  progress.finish();
  file.commit();
  std::cout << options.output.string() << std::endl;
}

void bake_on_mesh(const BakeOptions& options, const Volume& volume, AtomicFile& file) {
  bake_mesh(options, volume.texture, file.temporary_path());
  file.commit();
  std::error_code ignored;
  fs::remove(options.checkpoint, ignored);
  std::cout << options.output.string() << std::endl;
}

void preview(const BakeOptions& options, const Volume& volume, AtomicFile& file) {
  write_preview(file.temporary_path(), volume, options.show);
  file.commit();
  std::cout << options.preview.string() << std::endl;
}

// A write that fails is reported by the name that the file would have had.
template <class Work>
void by_final_name(const AtomicFile& file, const Work& work) {
  try {
    work();
  } catch (const WriteError& error) {
    throw std::runtime_error(file.final_path(error.path()).string() + ": " + error.what());
  }
}

void run(const BakeOptions& options) {
  install_interrupt_handler();
  check_targets(options);
  const int threads = options.threads ? options.threads : tbb::info::default_concurrency();
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
  solidtex::options chosen{.seed = options.seed, .precision = options.precision};
  // Ctrl-C ends the queries of a mesh, too, which may be long; those of a volume are blocks.
  if (!options.mesh.empty()) chosen.progress_callback = [](double) { return interrupted(); };
  const solidtex::texture texture(options.model, std::move(chosen));
  const Volume volume{texture, options.origin, options.size};
  channel_group(texture, options.show);  // refuses a wrong name before anything is written

  std::optional<AtomicFile> output_file, preview_file;
  if (!options.output.empty()) output_file.emplace(options.output);
  if (!options.preview.empty()) preview_file.emplace(options.preview);
  tbb::task_arena(threads).execute([&] {
    if (output_file)
      by_final_name(*output_file, [&] {
        (options.mesh.empty() ? bake : bake_on_mesh)(options, volume, *output_file);
      });
    if (preview_file)
      by_final_name(*preview_file, [&] { preview(options, volume, *preview_file); });
  });
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Bakes a solid texture: a box of it into voxels, or what a mesh shows of it.",
               "solidtex-bake");
  BakeOptions options;
  add_options(app, options);
  return run_tool(app, argc, argv, [&] { run(options); });
}
