#include <bit>
#include <sstream>

#include "tools/bake/output_file.h"
#include "tools/bake/sink.h"

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
  NpySink(const std::filesystem::path& path, const Volume& volume) : file_(path) {
    const std::string header = npy_header(volume);
    file_.write(header.data(), header.size());
  }

  void take(const Slab& slab) override {
    file_.write(slab.values.data(), slab.values.size_bytes());
  }

  void finish() override { file_.close(); }

 private:
  OutputFile file_;
};

}  // namespace

std::unique_ptr<Sink> make_npy_sink(const std::filesystem::path& path, const Volume& volume) {
  return std::make_unique<NpySink>(path, volume);
}

}  // namespace solidtex::tools
