#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tools/bake/image_file.h"
#include "tools/bake/sink.h"
#include "tools/common/output_file.h"

namespace solidtex::tools {
namespace {

class FlipbookSink : public Sink {
 public:
  FlipbookSink(std::filesystem::path path, const Output& output, const Volume& volume)
      : path_(std::move(path)),
        output_(output),
        volume_(volume),
        sheet_(flipbook_sheet(volume.size)),
        encoder_(output, output.channels),
        pixels_(static_cast<std::size_t>(sheet_.width * sheet_.height) *
                encoder_.bytes_per_voxel()),
        description_(companions({output.path, output.format.name, {}, {}, {}, {}})[0]) {}

  std::int64_t depth() const override { return volume_.size[2]; }

  void take(const Piece& piece) override {
    const auto [size_x, size_y, size_z] = piece.size;
    for (std::int64_t z = 0; z < size_z; ++z) {
      const std::int64_t frame = piece.offset[2] + z;
      const std::int64_t left = frame % sheet_.columns * volume_.size[0] + piece.offset[0];
      const std::int64_t top = frame / sheet_.columns * volume_.size[1] + piece.offset[1];
      for (std::int64_t y = 0; y < size_y; ++y) {
        const auto pixel = static_cast<std::size_t>((top + y) * sheet_.width + left);
        encoder_.encode(
            &piece.values[static_cast<std::size_t>(y * size_z + z) * volume_.channels()],
            static_cast<std::size_t>(size_y * size_z) * volume_.channels(),
            static_cast<std::size_t>(size_x), &pixels_[pixel * encoder_.bytes_per_voxel()]);
      }
    }
  }

  void finish() override {
    write_description();
    write_png(path_,
              {static_cast<int>(sheet_.width), static_cast<int>(sheet_.height),
               static_cast<int>(output_.channels.size()), output_.depth == Depth::uint16,
               output_.encoding(output_.groups.front())},
              pixels_);
    description_.commit();
  }

 private:
  void write_description() const {
    const nlohmann::ordered_json description = {
        {"image", output_.path.filename().string()},
        {"model", volume_.texture.name()},
        {"seed", volume_.texture.seed()},
        {"frames", volume_.size[2]},
        {"columns", sheet_.columns},
        {"rows", sheet_.rows},
        {"frame_width", volume_.size[0]},
        {"frame_height", volume_.size[1]},
        {"order", "rows from the top left, frame z is slice z"},
        {"channels", output_.names},
        {"color_space", encoding_name(output_.encoding(output_.groups.front()))},
        {"bits", 8 * output_.bytes_per_value()},
        {"origin", volume_.origin},
        {"voxel_size", output_.voxel_size.edges},
        {"unit", output_.voxel_size.unit}};
    const std::string text = description.dump(2) + "\n";
    OutputFile file(description_.temporary_path(), description_.target());
    file.write(0, text.data(), text.size());
    file.close();
  }

  std::filesystem::path path_;
  Output output_;
  Volume volume_;
  FlipbookSheet sheet_;
  VoxelEncoder encoder_;
  std::vector<std::byte> pixels_;
  AtomicFile description_;
};

}  // namespace

FlipbookSheet flipbook_sheet(const Index3& size) {
  FlipbookSheet sheet;
  const double square = std::sqrt(static_cast<double>(size[2]) * static_cast<double>(size[1]) /
                                  static_cast<double>(size[0]));
  sheet.columns =
      std::clamp(std::llround(std::ceil(square - 1e-9)), 1LL, static_cast<long long>(size[2]));
  sheet.rows = (size[2] + sheet.columns - 1) / sheet.columns;
  sheet.width = sheet.columns * size[0];
  sheet.height = sheet.rows * size[1];
  return sheet;
}

std::unique_ptr<Sink> make_flipbook_sink(const std::filesystem::path& path, const Output& output,
                                         const Volume& volume) {
  return std::make_unique<FlipbookSink>(path, output, volume);
}

}  // namespace solidtex::tools
