#include <bit>
#include <sstream>

#include "tools/bake/sink.h"
#include "tools/common/output_file.h"

namespace solidtex::tools {
namespace {

const char* type_name(Depth depth) {
  switch (depth) {
    case Depth::uint8:
      return "u1";
    case Depth::uint16:
      return "u2";
    case Depth::half:
      return "f2";
    case Depth::float32:
      return "f4";
  }
  return "";
}

// NumPy's format 1.0: magic, version, header length, a Python dictionary padded to 64 bytes.
std::string npy_header(const Output& output, const Volume& volume) {
  std::ostringstream text;
  text << "{'descr': '" << (std::endian::native == std::endian::little ? '<' : '>')
       << type_name(output.depth) << "', 'fortran_order': False, 'shape': (" << volume.size[0]
       << ", " << volume.size[1] << ", " << volume.size[2] << ", " << output.channels.size()
       << "), }";
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
  NpySink(const std::filesystem::path& path, const Output& output, const Volume& volume)
      : file_(path),
        volume_(volume),
        encoder_(output, output.channels),
        header_(npy_header(output, volume)) {
    file_.write(0, header_.data(), header_.size());
  }

  std::int64_t depth() const override { return volume_.size[2]; }

  // Rows that hold all of z are contiguous in the file.
  void take(const Piece& piece) override {
    const std::int64_t rows = piece.size[2] == volume_.size[2] ? piece.size[1] : 1;
    const auto count = static_cast<std::size_t>(rows * piece.size[2]);
    std::vector<std::byte> bytes(count * encoder_.bytes_per_voxel());
    const float* from = piece.values.data();
    for (std::int64_t x = 0; x < piece.size[0]; ++x) {
      for (std::int64_t y = 0; y < piece.size[1]; y += rows) {
        encoder_.encode(from, volume_.channels(), count, bytes.data());
        const std::int64_t row = (piece.offset[0] + x) * volume_.size[1] + piece.offset[1] + y;
        file_.write(place(row * volume_.size[2] + piece.offset[2]), bytes.data(), bytes.size());
        from += count * volume_.channels();
      }
    }
  }

  void finish() override { file_.close(); }

 private:
  std::uint64_t place(std::int64_t voxel) const {
    return header_.size() + static_cast<std::uint64_t>(voxel) * encoder_.bytes_per_voxel();
  }

  OutputFile file_;
  Volume volume_;
  VoxelEncoder encoder_;
  std::string header_;
};

}  // namespace

std::unique_ptr<Sink> make_npy_sink(const std::filesystem::path& path, const Output& output,
                                    const Volume& volume) {
  return std::make_unique<NpySink>(path, output, volume);
}

}  // namespace solidtex::tools
