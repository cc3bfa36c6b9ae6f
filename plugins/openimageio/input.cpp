#include "plugins/openimageio/input.h"

#include <exception>
#include <filesystem>
#include <utility>

#include "plugins/openimageio/read.h"

namespace solidtex::openimageio {
namespace {

namespace fs = std::filesystem;

constexpr char kExtension[] = ".solidtex";
// Tiles are as large as the engine's bricks of means, so that hardly one is asked for twice.
constexpr std::uint64_t kBrickBytes = std::uint64_t{32} << 20;

// What solidtex_open calls the model: a name without a folder is one of a shipped model where no
// such file lies in the current folder.
std::string model_of(const std::string& file) {
  const fs::path path(file);
  std::error_code ignored;
  const bool is_file = path.has_parent_path() || fs::exists(path, ignored);
  return is_file ? file : path.stem().string();
}

std::string color_space_of(const texture& texture) {
  const std::string space = texture.color_space();
  if (space == "srgb") return "sRGB";
  return space == "linear" ? "Linear" : space;
}

}  // namespace

bool Input::valid_file(const std::string& name) const {
  return fs::path(name.substr(0, name.find('?'))).extension() == kExtension;
}

bool Input::open(const std::string& name, OIIO::ImageSpec& spec) {
  close();
  try {
    const Query query = parse_query(name);
    texture_.emplace(model_of(query.model),
                     options{.seed = query.seed, .cache_limit_bytes = kBrickBytes});
    const int first = query.lod.value_or(0), last = query.lod.value_or(last_lod(query.size));
    for (int lod = first; lod <= last; ++lod) {
      levels_.emplace_back(query, lod);
      specs_.push_back(spec_of(query, levels_.back()));
    }
    for (OIIO::ImageSpec& each : specs_) {
      each.attribute("oiio:subimages", static_cast<int>(specs_.size()));
    }
  } catch (const QueryError& error) {
    errorfmt("{}: {}", name.substr(0, name.find('?')), error.what());
    close();
    return false;
  } catch (const std::exception& error) {  // the engine's messages name the file
    errorfmt("{}", error.what());
    close();
    return false;
  }
  seek_subimage(0, 0);
  spec = m_spec;
  return true;
}

bool Input::close() {
  texture_.reset();
  levels_.clear();
  specs_.clear();
  m_spec = OIIO::ImageSpec();
  current_ = 0;
  return true;
}

OIIO::ImageSpec Input::spec_of(const Query& query, const Level& level) const {
  OIIO::ImageSpec spec(level.size()[0], level.size()[1],
                       static_cast<int>(texture_->channel_count()),
                       query.is_half ? OIIO::TypeHalf : OIIO::TypeFloat);
  spec.depth = spec.full_depth = level.size()[2];
  spec.tile_width = level.tile()[0];
  spec.tile_height = level.tile()[1];
  spec.tile_depth = level.tile()[2];
  // The constructor takes a fourth channel for alpha.
  spec.alpha_channel = spec.z_channel = -1;
  for (std::size_t channel = 0; channel < texture_->channel_count(); ++channel) {
    spec.channelnames[channel] = texture_->channel_name(channel);
  }
  const std::array<float, 16> matrix = level.world_to_local();
  spec.attribute("worldtolocal", OIIO::TypeMatrix, matrix.data());
  // Outside of the image there is nothing that could be taken for the material.
  spec.attribute("wrapmodes", "black,black");
  spec.attribute("oiio:ColorSpace", color_space_of(*texture_));
  spec.attribute("oiio:subimagename", "lod" + std::to_string(level.lod()));
  spec.attribute("Software", "solidtex " + version());
  spec.attribute("solidtex:model", texture_->name());
  spec.attribute("solidtex:lod", level.lod());
  const std::uint64_t seed = texture_->seed();
  spec.attribute("solidtex:seed", OIIO::TypeDesc::UINT64, &seed);
  const std::array<int, 3> origin = {static_cast<int>(query.origin[0]),
                                     static_cast<int>(query.origin[1]),
                                     static_cast<int>(query.origin[2])};
  spec.attribute("solidtex:origin", OIIO::TypeDesc(OIIO::TypeDesc::INT, 3), origin.data());
  return spec;
}

bool Input::is_there(int subimage, int miplevel) const {
  return subimage >= 0 && subimage < static_cast<int>(levels_.size()) && miplevel == 0;
}

bool Input::seek_subimage(int subimage, int miplevel) {
  if (!is_there(subimage, miplevel)) return false;
  current_ = subimage;
  m_spec = specs_[static_cast<std::size_t>(subimage)];
  return true;
}

OIIO::ImageSpec Input::spec(int subimage, int miplevel) {
  if (!is_there(subimage, miplevel)) return {};
  return specs_[static_cast<std::size_t>(subimage)];
}

OIIO::ImageSpec Input::spec_dimensions(int subimage, int miplevel) {
  OIIO::ImageSpec dimensions;
  if (is_there(subimage, miplevel)) {
    dimensions.copy_dimensions(specs_[static_cast<std::size_t>(subimage)]);
  }
  return dimensions;
}

bool Input::read_tiles(int subimage, int miplevel, int xbegin, int xend, int ybegin, int yend,
                       int zbegin, int zend, int chbegin, int chend, OIIO::TypeDesc format,
                       void* data, OIIO::stride_t xstride, OIIO::stride_t ystride,
                       OIIO::stride_t zstride) {
  if (!is_there(subimage, miplevel)) {
    errorfmt("subimage {}, level {} of its mipmap, expected a subimage below {} and level 0",
             subimage, miplevel, levels_.size());
    return false;
  }
  const auto index = static_cast<std::size_t>(subimage);
  if (!specs_[index].valid_tile_range(xbegin, xend, ybegin, yend, zbegin, zend)) {
    errorfmt("pixels {}-{}, {}-{}, {}-{}, expected whole tiles", xbegin, xend, ybegin, yend, zbegin,
             zend);
    return false;
  }
  const Target target{data, format, xstride, ystride, zstride, chbegin, chend};
  try {
    read_region(*texture_, levels_[index], specs_[index],
                {{xbegin, ybegin, zbegin}, {xend, yend, zend}}, target);
    return true;
  } catch (const std::exception& error) {
    errorfmt("{}", error.what());
    return false;
  }
}

bool Input::read_native_tile(int subimage, int miplevel, int x, int y, int z, void* data) {
  const OIIO::ImageSpec spec = spec_dimensions(subimage, miplevel);
  return read_tiles(subimage, miplevel, x, x + spec.tile_width, y, y + spec.tile_height, z,
                    z + spec.tile_depth, 0, spec.nchannels, spec.format, data, OIIO::AutoStride,
                    OIIO::AutoStride, OIIO::AutoStride);
}

bool Input::read_native_scanline(int subimage, int, int, int, void*) {
  errorfmt("subimage {} was asked for a scanline, expected tiles", subimage);
  return false;
}

}  // namespace solidtex::openimageio
