// PNG and EXR files. libpng and OpenEXR are used directly, so that every failed write is noticed;
// OpenImageIO would add 260 shared libraries.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "tools/bake/channels.h"
#include "tools/bake/description.h"

namespace solidtex::tools {

struct Image {
  int width = 0, height = 0, channels = 0;
  std::vector<float> values;  // row by row from the top

  Image(int w, int h, int c)
      : width(w),
        height(h),
        channels(c),
        values(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) *
               static_cast<std::size_t>(c)) {}
  float* pixel(int x, int y) {
    return &values[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                    static_cast<std::size_t>(x)) *
                   static_cast<std::size_t>(channels)];
  }
};

// What readers ask for beside the pixels.
struct ImageNotes {
  Fields fields{};               // attributes of an EXR file, lines of a PNG file's description
  double width = 1, height = 1;  // of a pixel
  bool is_in_meters = false;     // else only the ratio of width to height is known
};

struct PngFormat {
  int width, height;
  int channels;  // 1 or 3
  bool has_16_bits = false;
  Encoding colors = Encoding::srgb;
  ImageNotes notes{};
};

// Returns the bytes of a PNG file; errors name `path`.
std::vector<unsigned char> encode_png(const std::filesystem::path& path, const PngFormat& format,
                                      std::span<const std::byte> pixels);
// Writes pixels row by row from the top, of native byte order. Throws WriteError.
void write_png(const std::filesystem::path& path, const PngFormat& format,
               std::span<const std::byte> pixels);

// Writes sRGB-encoded values in 8 bits.
void write_png(const std::filesystem::path& path, const Image& image);

// EXR with float or half channels, written in bands of rows, so that it need not fit into memory.
// `colors`: encoding of R, G and B, or data. All functions throw WriteError.
class ExrFile {
 public:
  ExrFile(const std::filesystem::path& path, int width, int height,
          const std::vector<std::string>& channel_names, Encoding colors, bool is_half = false,
          const ImageNotes& notes = {});
  ~ExrFile();

  // Writes the next rows from the top: floats, or halfs, [y][x][channel].
  void write_rows(const void* values, int count);

  // Completes the file after the last row.
  void close();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace solidtex::tools
