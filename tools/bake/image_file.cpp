#include "tools/bake/image_file.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <exception>
#include <optional>

#include "tools/common/output_file.h"

namespace solidtex::tools {
namespace {

using Bytes = std::vector<unsigned char>;

void append_bytes(png_structp png, png_bytep from, std::size_t count) {
  auto& bytes = *static_cast<Bytes*>(png_get_io_ptr(png));
  bytes.insert(bytes.end(), from, from + count);
}

// Pixels in a meter, where PNG can hold that number.
void write_scale(png_structp png, png_infop info, const ImageNotes& notes) {
  const double x = std::round(1 / notes.width), y = std::round(1 / notes.height);
  if (notes.is_in_meters && std::min(x, y) >= 1 && std::max(x, y) <= PNG_UINT_31_MAX)
    png_set_pHYs(png, info, static_cast<png_uint_32>(x), static_cast<png_uint_32>(y),
                 PNG_RESOLUTION_METER);
}

// `lines` are UTF-8.
void write_description(png_structp png, png_infop info, const char* lines) {
  if (!*lines) return;
  char key[] = "Description";
  png_text text{};
  text.compression = PNG_ITXT_COMPRESSION_NONE;
  text.key = key;
  text.text = const_cast<char*>(lines);
  text.itxt_length = std::strlen(lines);
  png_set_text(png, info, &text, 1);
}

// Returns false on an error: libpng jumps over destructors, so there are none here.
bool encode(png_structp png, png_infop info, const PngFormat& format, const char* description,
            const std::byte* pixels, Bytes* bytes) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_set_write_fn(png, bytes, append_bytes, nullptr);
  png_set_IHDR(png, info, static_cast<png_uint_32>(format.width),
               static_cast<png_uint_32>(format.height), format.has_16_bits ? 16 : 8,
               format.channels == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (format.colors == Encoding::srgb) png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
  if (format.colors == Encoding::linear) png_set_gAMA(png, info, 1.0);
  write_scale(png, info, format.notes);
  write_description(png, info, description);
  if (!format.has_16_bits) {  // the fast settings of libpng's simplified interface
    png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_NO_FILTERS);
    png_set_compression_level(png, 3);
  }
  png_write_info(png, info);
  if (format.has_16_bits) png_set_swap(png);  // to big endian
  const std::size_t value = format.has_16_bits ? 2 : 1;
  const std::size_t row =
      value * static_cast<std::size_t>(format.width) * static_cast<std::size_t>(format.channels);
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

// Names of the Color Interop Forum; OpenEXR 3.4 makes "colorInteropID" a standard attribute.
const char* color_name(Encoding encoding) {
  constexpr const char* names[] = {"srgb_rec709_scene", "lin_rec709_scene", "data"};
  return names[static_cast<int>(encoding)];
}

// The ratio that OpenEXR accepts; 1 where it is beyond.
float aspect(const ImageNotes& notes) {
  const double ratio = notes.width / notes.height;
  return ratio >= 1e-6 && ratio <= 1e6 ? static_cast<float>(ratio) : 1;
}

void add_notes(Imf::Header& header, Encoding colors, const ImageNotes& notes) {
  constexpr double inch = 0.0254;
  header.insert("colorInteropID", Imf::StringAttribute(color_name(colors)));
  if (colors == Encoding::srgb)  // OpenImageIO before 3.1 knows this name alone
    header.insert("oiio:ColorSpace", Imf::StringAttribute("sRGB"));
  if (colors != Encoding::data) Imf::addChromaticities(header, Imf::Chromaticities());  // Rec. 709
  if (notes.is_in_meters) Imf::addXDensity(header, static_cast<float>(inch / notes.width));
  for (const auto& [key, value] : notes.fields) header.insert(key, Imf::StringAttribute(value));
}

Imf::Header header_of(int width, int height, const std::vector<std::string>& names,
                      Imf::PixelType type, Encoding colors, const ImageNotes& notes) {
  Imf::Header header(width, height, aspect(notes));
  add_notes(header, colors, notes);
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
  const std::string description = lines_of(format.notes.fields);
  const bool good = info && encode(png, info, format, description.c_str(), pixels.data(), &bytes);
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
                 const std::vector<std::string>& names, Encoding colors, bool is_half,
                 const ImageNotes& notes)
    : state_(new State{ExrStream(path), names, static_cast<std::size_t>(width),
                       is_half ? Imf::HALF : Imf::FLOAT, 0, std::nullopt}) {
  state_->image.emplace(state_->stream,
                        header_of(width, height, names, state_->type, colors, notes));
}

ExrFile::~ExrFile() = default;

void ExrFile::write_rows(const void* values, int count) {
  const std::size_t value = state_->type == Imf::HALF ? sizeof(half) : sizeof(float);
  const std::size_t pixel = value * state_->names.size();
  const std::size_t row = pixel * state_->width;
  const Imath::V2i first(0, state_->row);
  Imf::FrameBuffer pixels;
  for (std::size_t i = 0; i < state_->names.size(); ++i) {
    const char* const channel = static_cast<const char*>(values) + i * value;
    pixels.insert(state_->names[i],
                  Imf::Slice::Make(state_->type, channel, first,
                                   static_cast<std::int64_t>(state_->width), count, pixel, row));
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
