// solidtex-detect: finds where a photograph has the texture of one of its patches.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "tools/common/cli.h"
#include "tools/common/output_file.h"
#include "tools/detect/windows.h"

namespace {

namespace fs = std::filesystem;
using namespace solidtex::tools;

constexpr std::size_t kFullSize = std::size_t{1} << 30;  // of a photograph that is not reduced

struct Options {
  std::string space;
  fs::path photograph, output;
  std::vector<std::size_t> patch;
  std::size_t step = 16;
  double alpha = 3;
  bool force = false;
};

constexpr char examples[] =
    "SPACE is the path of a .solidtex-space file, or the name of a shipped space. The photograph\n"
    "is taken at its own size: the space has learned materials at its resolution.\n"
    "A pixel of the heat map is 1 where the code of the window around it is that of the patch.\n"
    "Examples:\n"
    "  solidtex-detect stones wall.jpg --patch 40,60,128,128 -o heat.png\n"
    "  solidtex-detect stones wall.jpg --patch 0,0,256,200 --step 4 --alpha 1 -o heat.exr\n"
    "Exit code: 0 the map is written, 1 it is not, 2 wrong usage.";

void add_options(CLI::App& app, Options& options) {
  app.footer(examples);
  app.add_option("SPACE", options.space, "Texture space: path, or name of a shipped one")
      ->required();
  app.add_option("PHOTO", options.photograph, "Photograph: JPEG, PNG, TIFF, EXR ...")->required();
  app.add_option("--patch", options.patch,
                 "Patch whose texture is looked for: left, top, width and height in pixels")
      ->required()
      ->delimiter(',')
      ->expected(4)
      ->check(in_range(0, std::numeric_limits<int>::max()).description(""))
      ->type_name("X,Y,W,H");
  app.add_option("-o,--output", options.output,
                 "Heat map: .png, .tif or .exr; - or -.exr for standard output")
      ->required()
      ->type_name("HEAT");
  app.add_option("--step", options.step, "Pixels between two windows (default: 16)")
      ->check(in_range(1, 4096))
      ->type_name("N");
  app.add_option("--alpha", options.alpha, "Sharpness of the map, equation 10 (default: 3)")
      ->check(in_range(1e-6, 1e6))
      ->type_name("A");
  app.add_flag("--force", options.force, "Replace a file that exists");
}

void check_target(const Options& options) {
  const std::string extension = lower_extension(options.output);
  if (extension != ".png" && extension != ".tif" && extension != ".exr")
    throw std::runtime_error("-o " + options.output.string() +
                             ": expected a name that ends in .png, .tif or .exr");
  check_output(options.output, {options.photograph, options.space}, options.force);
}

Rectangle checked_patch(const Options& options, const Photograph& photograph, std::size_t side) {
  const auto& p = options.patch;
  const std::string found = "--patch: found " + std::to_string(p[0]) + "," + std::to_string(p[1]) +
                            "," + std::to_string(p[2]) + "," + std::to_string(p[3]);
  if (p[2] < side || p[3] < side)
    throw std::runtime_error(found + ", expected a width and a height of at least " +
                             std::to_string(side) + ", the encoder's patch");
  if (p[0] > photograph.width || p[2] > photograph.width - p[0] || p[1] > photograph.height ||
      p[3] > photograph.height - p[1])
    throw std::runtime_error(found + ", expected a part of the photograph of " +
                             std::to_string(photograph.width) + " x " +
                             std::to_string(photograph.height) + " pixels");
  return {p[0], p[1], p[2], p[3]};
}

void write_map(const fs::path& file, const std::vector<float>& heat, const Photograph& size) {
  const auto output = OIIO::ImageOutput::create(file.string());
  const bool is_png = lower_extension(file) == ".png";
  OIIO::ImageSpec spec(static_cast<int>(size.width), static_cast<int>(size.height), 1,
                       is_png ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::FLOAT);
  spec.attribute("oiio:ColorSpace", "Linear");
  if (!output) throw WriteError(file, OIIO::geterror());
  OIIO::Filesystem::IOVecOutput encoded;  // OpenImageIO hides a full disk for some formats
  const bool is_in_memory = output->set_ioproxy(&encoded);
  if (!output->open(file.string(), spec) ||
      !output->write_image(OIIO::TypeDesc::FLOAT, heat.data()) || !output->close())
    throw WriteError(file, output->geterror());
  if (!is_in_memory) return;
  OutputFile stream(file);
  stream.write(0, encoded.buffer().data(), encoded.buffer().size());
  stream.close();
}

void run(Options& options) {
  install_interrupt_handler();
  pipe_output(options.output, "heat.png");
  check_target(options);
  const solidtex::space space(options.space);
  const std::size_t side = space.patch_size();
  const Photograph photograph = read_photograph(options.photograph, kFullSize, side);
  for (const std::string& note : photograph.notes) say(options.photograph.string() + ": " + note);
  const Rectangle patch = checked_patch(options, photograph, side);
  const Code wanted = mean(encode_windows(space, photograph, patch, options.step).codes);
  const Rectangle whole{0, 0, photograph.width, photograph.height};
  const Windows windows = encode_windows(space, photograph, whole, options.step);
  const std::vector<float> heat =
      interpolated(windows, similarities(windows, wanted, options.alpha), side, photograph.width,
                   photograph.height);
  write_completely(options.output,
                   [&](const fs::path& file) { write_map(file, heat, photograph); });
  report("windows", windows.codes.size());
  report("window_size", side);
  const std::string edge = std::to_string(side);
  report_file(options.output, ": " + count_of(windows.codes.size(), "window") + " of " + edge +
                                  " x " + edge + " pixels");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Finds where a photograph has the texture of one of its patches, by the codes of a texture "
      "space (Alanov et al. 2019, section 4.5).",
      "solidtex-detect");
  Options options;
  add_options(app, options);
  return run_tool(app, argc, argv, [&] { run(options); });
}
