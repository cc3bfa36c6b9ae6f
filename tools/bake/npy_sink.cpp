#include <bit>
#include <sstream>

#include "tools/bake/sink.h"
#include "tools/common/output_file.h"

namespace solidtex::tools {
namespace {

// NumPy's format 1.0: magic, version, header length, a Python dictionary padded to 64 bytes.
std::string npy_header(const Volume& volume) {
  std::ostringstream text;
  text << "{'descr': '" << (std::endian::native == std::endian::little ? '<' : '>')
       << "f4', 'fortran_order': False, 'shape': (" << volume.size[0] << ", " << volume.size[1]
       << ", " << volume.size[2] << ", " << volume.channels() << "), }";
  std::string dictionary = text.str();
  constexpr std::size_t preamble = 10;
  dictionary.resize((preamble + dictionary.size() + 1 + 63) / 64 * 64 - preamble - 1, ' ');
  dictionary += '\n';
  std::string header("\x93NUMPY\x01\x00", 8);
  header += static_cast<char>(dictionary.size() & 0xFF);
  header += static_cast<char>(dictionary.size() >> 8);
  return header + dictionary;
}

class NpySink : public Sink {
 public:
  NpySink(const std::filesystem::path& path, const Volume& volume)
      : file_(path), volume_(volume), header_(npy_header(volume)) {
    file_.write(0, header_.data(), header_.size());
  }

  std::int64_t depth() const override { return volume_.size[2]; }

  // Rows that hold all of z are contiguous in the file.
  void take(const Piece& piece) override {
    const std::int64_t rows = piece.size[2] == volume_.size[2] ? piece.size[1] : 1;
    const std::size_t count = static_cast<std::size_t>(rows * piece.size[2]) * volume_.channels();
    const float* from = piece.values.data();
    for (std::int64_t x = 0; x < piece.size[0]; ++x) {
      for (std::int64_t y = 0; y < piece.size[1]; y += rows, from += count) {
        const std::int64_t row = (piece.offset[0] + x) * volume_.size[1] + piece.offset[1] + y;
        file_.write(place(row * volume_.size[2] + piece.offset[2]), from, count * sizeof(float));
      }
    }
  }

  void finish() override { file_.close(); }

 private:
  std::uint64_t place(std::int64_t voxel) const {
    return header_.size() + static_cast<std::uint64_t>(voxel) * volume_.channels() * sizeof(float);
  }

  OutputFile file_;
  Volume volume_;
  std::string header_;
};

}  // namespace

std::unique_ptr<Sink> make_npy_sink(const std::filesystem::path& path, const Volume& volume) {
  return std::make_unique<NpySink>(path, volume);
}

}  // namespace solidtex::tools
