#include "tools/bake/image_file.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfOutputFile.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <exception>
#include <optional>

#include "tools/bake/channels.h"
#include "tools/common/output_file.h"

namespace solidtex::tools {
namespace {

using Bytes = std::vector<unsigned char>;

void append_bytes(png_structp png, png_bytep from, std::size_t count) {
  auto& bytes = *static_cast<Bytes*>(png_get_io_ptr(png));
  bytes.insert(bytes.end(), from, from + count);
}

// Returns false on an error: libpng jumps over destructors, so there are none here.
bool encode(png_structp png, png_infop info, const PngFormat& format, const std::byte* pixels,
            Bytes* bytes) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_set_write_fn(png, bytes, append_bytes, nullptr);
  png_set_IHDR(png, info, static_cast<png_uint_32>(format.width),
               static_cast<png_uint_32>(format.height), format.has_16_bits ? 16 : 8,
               format.channels == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (format.is_linear) {
    png_set_gAMA(png, info, 1.0);
  } else {
    png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
  }
  if (!format.has_16_bits) {  // the fast settings of libpng's simplified interface
    png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_NO_FILTERS);
    png_set_compression_level(png, 3);
  }
  png_write_info(png, info);
  if (format.has_16_bits) png_set_swap(png);  // to big endian
  const auto row =
      static_cast<std::size_t>((format.has_16_bits ? 2 : 1) * format.width * format.channels);
  for (int y = 0; y < format.height; ++y)
    png_write_row(png,
                  reinterpret_cast<png_const_bytep>(pixels) + static_cast<std::size_t>(y) * row);
  png_write_end(png, info);
  return true;
}

// The stream that OpenEXR writes to. It keeps a failure until check(): OpenEXR's destructors
// swallow exceptions.
class ExrStream : public Imf::OStream {
 public:
  explicit ExrStream(const std::filesystem::path& path) : Imf::OStream(path.c_str()), file_(path) {}

  void write(const char* data, int count) override {
    if (failure_) return;
    try {
      file_.write(at_, data, static_cast<std::size_t>(count));
    } catch (const WriteError&) {
      failure_ = std::current_exception();
    }
    at_ += static_cast<std::size_t>(count);
  }
  std::uint64_t tellp() override { return at_; }
  void seekp(std::uint64_t position) override { at_ = position; }

  void check() const {
    if (failure_) std::rethrow_exception(failure_);
  }
  void close() { file_.close(); }

 private:
  OutputFile file_;
  std::uint64_t at_ = 0;
  std::exception_ptr failure_;
};

Imf::Header header_of(int width, int height, const std::vector<std::string>& names,
                      Imf::PixelType type) {
  Imf::Header header(width, height);
  header.compression() = Imf::ZIP_COMPRESSION;
  for (const std::string& name : names) header.channels().insert(name, Imf::Channel(type));
  return header;
}

}  // namespace

std::vector<unsigned char> encode_png(const std::filesystem::path& path, const PngFormat& format,
                                      std::span<const std::byte> pixels) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  Bytes bytes;
  const bool good = info && encode(png, info, format, pixels.data(), &bytes);
  png_destroy_write_struct(&png, &info);
  if (!good) throw WriteError(path, "libpng cannot encode the image");
  return bytes;
}

void write_png(const std::filesystem::path& path, const PngFormat& format,
               std::span<const std::byte> pixels) {
  const Bytes bytes = encode_png(path, format, pixels);
  OutputFile file(path);
  file.write(0, bytes.data(), bytes.size());
  file.close();
}

void write_png(const std::filesystem::path& path, const Image& image) {
  std::vector<std::uint8_t> pixels(image.values.size());
  std::ranges::transform(image.values, pixels.begin(), quantize<std::uint8_t>);
  write_png(path, {image.width, image.height, image.channels}, std::as_bytes(std::span(pixels)));
}

struct ExrFile::State {
  ExrStream stream;
  std::vector<std::string> names;
  std::size_t width;
  Imf::PixelType type;
  int row = 0;
  std::optional<Imf::OutputFile> image;
};

ExrFile::ExrFile(const std::filesystem::path& path, int width, int height,
                 const std::vector<std::string>& names, bool is_half)
    : state_(new State{ExrStream(path), names, static_cast<std::size_t>(width),
                       is_half ? Imf::HALF : Imf::FLOAT, 0, std::nullopt}) {
  state_->image.emplace(state_->stream, header_of(width, height, names, state_->type));
}

ExrFile::~ExrFile() = default;

void ExrFile::write_rows(const void* values, int count) {
  const std::size_t value = state_->type == Imf::HALF ? sizeof(half) : sizeof(float);
  const std::size_t pixel = value * state_->names.size();
  const std::size_t row = pixel * state_->width;
  // OpenEXR counts rows from the image's first one.
  const std::size_t before = row * static_cast<std::size_t>(state_->row);
  Imf::FrameBuffer pixels;
  for (std::size_t i = 0; i < state_->names.size(); ++i) {
    const auto first = reinterpret_cast<std::uintptr_t>(values) + i * value - before;
    pixels.insert(state_->names[i],
                  Imf::Slice(state_->type, reinterpret_cast<char*>(first), pixel, row));
  }
  state_->image->setFrameBuffer(pixels);
  state_->image->writePixels(count);
  state_->row += count;
  state_->stream.check();
}

void ExrFile::close() {
  state_->image.reset();  // writes where the rows lie
  state_->stream.check();
  state_->stream.close();
}

}  // namespace solidtex::tools
