#include "plugins/openimageio/read.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <stdexcept>
#include <vector>

namespace solidtex::openimageio {
namespace {

// Columns along x: the engine evaluates them with the smallest margins.
constexpr std::array<int, 3> kPiece = {256, 64, 64};

void fill_in(Target& target, const OIIO::ImageSpec& spec, const Region& region) {
  if (target.format == OIIO::TypeUnknown) target.format = spec.format;
  target.chbegin = std::clamp(target.chbegin, 0, spec.nchannels - 1);
  target.chend = std::clamp(target.chend, target.chbegin + 1, spec.nchannels);
  OIIO::ImageSpec::auto_stride(target.xstride, target.ystride, target.zstride, target.format,
                               target.chend - target.chbegin, region.size(0), region.size(1));
}

// Converts to the type of the image first, then to the type of the caller.
void round_to(const OIIO::TypeDesc& type, std::vector<float>& values) {
  if (type == OIIO::TypeFloat) return;
  std::vector<char> rounded(values.size() * type.size());
  OIIO::convert_pixel_values(OIIO::TypeFloat, values.data(), type, rounded.data(),
                             static_cast<int>(values.size()));
  OIIO::convert_pixel_values(type, rounded.data(), OIIO::TypeFloat, values.data(),
                             static_cast<int>(values.size()));
}

void read_piece(const texture& texture, const Level& level, const OIIO::ImageSpec& spec,
                const Region& piece, const Target& target) {
  std::vector<float> values(piece.voxel_count() * texture.channel_count());
  level.evaluate(texture, piece, values.data());
  round_to(spec.format, values);
  const auto xstride = static_cast<OIIO::stride_t>(texture.channel_count() * sizeof(float));
  const OIIO::stride_t ystride = xstride * piece.size(0), zstride = ystride * piece.size(1);
  const bool is_done = OIIO::convert_image(
      target.chend - target.chbegin, piece.size(0), piece.size(1), piece.size(2),
      values.data() + target.chbegin, OIIO::TypeFloat, xstride, ystride, zstride, target.data,
      target.format, target.xstride, target.ystride, target.zstride);
  if (!is_done) throw std::runtime_error(std::string("no pixels of type ") + target.format.c_str());
}

void read_pieces(const texture& texture, const Level& level, const OIIO::ImageSpec& spec,
                 const Region& region, const Target& target) {
  const auto& [low, high] = region;
  for (int z = low[2]; z < high[2]; z += kPiece[2])
    for (int y = low[1]; y < high[1]; y += kPiece[1])
      for (int x = low[0]; x < high[0]; x += kPiece[0]) {
        const Region piece{{x, y, z},
                           {std::min(high[0], x + kPiece[0]), std::min(high[1], y + kPiece[1]),
                            std::min(high[2], z + kPiece[2])}};
        Target part = target;
        part.data = static_cast<char*>(target.data) + (x - low[0]) * target.xstride +
                    (y - low[1]) * target.ystride + (z - low[2]) * target.zstride;
        read_piece(texture, level, spec, piece, part);
      }
}

}  // namespace

void read_region(const texture& texture, const Level& level, const OIIO::ImageSpec& spec,
                 const Region& region, Target target) {
  fill_in(target, spec, region);
  const auto& tile = level.tile();
  const bool is_tile =
      region.size(0) <= tile[0] && region.size(1) <= tile[1] && region.size(2) <= tile[2];
  if (!is_tile) return read_pieces(texture, level, spec, region, target);
  tbb::task_arena alone(1);
  alone.execute([&] { read_pieces(texture, level, spec, region, target); });
}

}  // namespace solidtex::openimageio
