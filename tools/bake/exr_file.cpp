#include "tools/bake/exr_file.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfOutputFile.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <optional>

#include "tools/bake/output_file.h"

namespace solidtex::tools {
namespace {

// What OpenEXR writes. Failures are kept: its destructors swallow exceptions.
class Stream : public Imf::OStream {
 public:
  explicit Stream(const std::filesystem::path& path) : Imf::OStream(path.c_str()), file_(path) {}

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

struct ExrFile::State {
  Stream stream;
  std::vector<std::string> names;
  std::size_t width;
  int row = 0;
  std::optional<Imf::OutputFile> image;
};

ExrFile::ExrFile(const std::filesystem::path& path, int width, int height,
                 const std::vector<std::string>& names)
    : state_(new State{Stream(path), names, static_cast<std::size_t>(width), 0, std::nullopt}) {
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
