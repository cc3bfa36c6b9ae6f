#include "tools/bake/image.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfOutputFile.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "tools/bake/output_file.h"

// PNG and EXR by their own libraries, encoded in memory so that every failed write is noticed.
// OpenImageIO wrote them before: it brings 260 shared libraries along, 115 MiB and 0.15 s to load.
namespace solidtex::tools {
namespace {

using Bytes = std::vector<unsigned char>;

void write_bytes(const std::filesystem::path& path, const Bytes& bytes) {
  OutputFile file(path);
  file.write(0, bytes.data(), bytes.size());
  file.close();
}

// What is not a number is black.
std::uint8_t to_8_bits(float value) {
  return value > 0 ? static_cast<std::uint8_t>(std::lround(std::min(value, 1.0f) * 255)) : 0;
}

Bytes encode_png(const std::filesystem::path& path, const Image& image) {
  std::vector<std::uint8_t> pixels(image.values.size());
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

// What OpenEXR writes, kept.
class MemoryStream : public Imf::OStream {
 public:
  MemoryStream() : Imf::OStream("image in memory") {}

  void write(const char* data, int count) override {
    bytes_.resize(std::max(bytes_.size(), at_ + static_cast<std::size_t>(count)));
    std::memcpy(bytes_.data() + at_, data, static_cast<std::size_t>(count));
    at_ += static_cast<std::size_t>(count);
  }
  std::uint64_t tellp() override { return at_; }
  void seekp(std::uint64_t position) override { at_ = position; }

  const Bytes& bytes() const { return bytes_; }

 private:
  Bytes bytes_;
  std::size_t at_ = 0;
};

}  // namespace

float srgb_to_linear(float value) {
  if (!(value > 0.04045f)) return value / 12.92f;
  return std::pow((value + 0.055f) / 1.055f, 2.4f);
}

float linear_to_srgb(float value) {
  if (!(value > 0.0031308f)) return value * 12.92f;
  return 1.055f * std::pow(value, 1 / 2.4f) - 0.055f;
}

void write_png(const std::filesystem::path& path, const Image& image) {
  write_bytes(path, encode_png(path, image));
}

void write_exr(const std::filesystem::path& path, const Image& image,
               const std::vector<std::string>& names) {
  Imf::Header header(image.width, image.height);
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::FrameBuffer pixels;
  const std::size_t pixel = sizeof(float) * static_cast<std::size_t>(image.channels);
  for (std::size_t i = 0; i < names.size(); ++i) {
    header.channels().insert(names[i], Imf::Channel(Imf::FLOAT));
    char* first = reinterpret_cast<char*>(const_cast<float*>(image.values.data() + i));
    pixels.insert(names[i], Imf::Slice(Imf::FLOAT, first, pixel,
                                       pixel * static_cast<std::size_t>(image.width)));
  }
  MemoryStream stream;
  {
    Imf::OutputFile file(stream, header);
    file.setFrameBuffer(pixels);
    file.writePixels(image.height);
  }  // finishes the stream
  write_bytes(path, stream.bytes());
}

}  // namespace solidtex::tools
