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

#include "tools/common/output_file.h"

namespace solidtex::tools {
namespace {

using Bytes = std::vector<unsigned char>;

Bytes encode_png(const std::filesystem::path& path, const Image& image) {
  Bytes pixels(image.values.size());
  std::transform(image.values.begin(), image.values.end(), pixels.begin(), to_8_bits);
  png_image header = {};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width);
  header.height = static_cast<png_uint_32>(image.height);
  header.format = image.channels == 1 ? PNG_FORMAT_GRAY : PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(header);
  Bytes bytes(size);
  if (!png_image_write_to_memory(&header, bytes.data(), &size, 0, pixels.data(), 0, nullptr))
    throw WriteError(path, header.message);
  bytes.resize(size);
  return bytes;
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

Imf::Header header_of(int width, int height, const std::vector<std::string>& names) {
  Imf::Header header(width, height);
  header.compression() = Imf::ZIP_COMPRESSION;
  for (const std::string& name : names) header.channels().insert(name, Imf::Channel(Imf::FLOAT));
  return header;
}

}  // namespace

std::uint8_t to_8_bits(float value) {
  return value > 0 ? static_cast<std::uint8_t>(std::lround(std::min(value, 1.0f) * 255)) : 0;
}

void write_png(const std::filesystem::path& path, const Image& image) {
  const Bytes bytes = encode_png(path, image);
  OutputFile file(path);
  file.write(0, bytes.data(), bytes.size());
  file.close();
}

struct ExrFile::State {
  ExrStream stream;
  std::vector<std::string> names;
  std::size_t width;
  int row = 0;
  std::optional<Imf::OutputFile> image;
};

ExrFile::ExrFile(const std::filesystem::path& path, int width, int height,
                 const std::vector<std::string>& names)
    : state_(new State{ExrStream(path), names, static_cast<std::size_t>(width), 0, std::nullopt}) {
  state_->image.emplace(state_->stream, header_of(width, height, names));
}

ExrFile::~ExrFile() = default;

void ExrFile::write_rows(const float* values, int count) {
  const std::size_t pixel = sizeof(float) * state_->names.size();
  const std::size_t row = pixel * state_->width;
  // OpenEXR counts rows from the image's first one.
  const std::size_t before = row * static_cast<std::size_t>(state_->row);
  Imf::FrameBuffer pixels;
  for (std::size_t i = 0; i < state_->names.size(); ++i) {
    const auto first = reinterpret_cast<std::uintptr_t>(values + i) - before;
    pixels.insert(state_->names[i],
                  Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(first), pixel, row));
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
