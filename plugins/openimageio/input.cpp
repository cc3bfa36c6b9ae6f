#include "plugins/openimageio/input.h"

#include <strings.h>

#include <exception>
#include <filesystem>
#include <utility>

#include "plugins/openimageio/atlas_level.h"
#include "plugins/openimageio/read.h"
#include "plugins/openimageio/volume_level.h"

namespace solidtex::openimageio {
namespace {

namespace fs = std::filesystem;

constexpr char kExtension[] = ".solidtex";
// Tiles are as large as the engine's bricks of means: few bricks are evaluated twice.
constexpr std::uint64_t kBrickBytes = std::uint64_t{32} << 20;

// The model name for solidtex_open: a name without a folder is a shipped model unless the current
// folder has such a file.
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
  const fs::path model = name.substr(0, name.find('?'));
  return strcasecmp(model.extension().c_str(), kExtension) == 0;
}

bool Input::open(const std::string& name, OIIO::ImageSpec& spec) {
  close();
  try {
    const Query query = parse_query(name);
    texture_.emplace(model_of(query.model),
                     options{.seed = query.seed, .cache_limit_bytes = kBrickBytes});
    is_atlas_ = !query.mesh.empty();
    is_atlas_ ? open_atlas(query) : open_volume(query);
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

void Input::open_volume(const Query& query) {
  const int first = query.lod.value_or(0), last = query.lod.value_or(last_lod(query.size));
  for (int lod = first; lod <= last; ++lod) {
    auto level = std::make_unique<const VolumeLevel>(query, lod);
    OIIO::ImageSpec& spec = specs_.emplace_back(spec_of(query, *level));
    const std::array<float, 16> matrix = level->world_to_local();
    spec.attribute("worldtolocal", OIIO::TypeMatrix, matrix.data());
    // Pixels outside of the image are black, not material.
    spec.attribute("wrapmodes", "black,black");
    spec.attribute("oiio:subimagename", "lod" + std::to_string(lod));
    spec.attribute("oiio:subimages", last - first + 1);
    spec.attribute("solidtex:lod", lod);
    levels_.push_back(std::move(level));
  }
}

void Input::open_atlas(const Query& query) {
  levels_ = atlas_levels(query);
  for (const auto& level : levels_) {
    OIIO::ImageSpec& spec = specs_.emplace_back(spec_of(query, *level));
    spec.attribute("wrapmodes", "clamp,clamp");
    spec.attribute("solidtex:mesh", query.mesh);
  }
}

bool Input::close() {
  texture_.reset();
  levels_.clear();
  specs_.clear();
  m_spec = OIIO::ImageSpec();
  subimage_ = miplevel_ = 0;
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
  spec.attribute("oiio:ColorSpace", color_space_of(*texture_));
  spec.attribute("Software", "solidtex " + version());
  spec.attribute("solidtex:model", texture_->name());
  const std::uint64_t seed = texture_->seed();
  spec.attribute("solidtex:seed", OIIO::TypeDesc::UINT64, &seed);
  const std::array<int, 3> origin = {static_cast<int>(query.origin[0]),
                                     static_cast<int>(query.origin[1]),
                                     static_cast<int>(query.origin[2])};
  spec.attribute("solidtex:origin", OIIO::TypeDesc(OIIO::TypeDesc::INT, 3), origin.data());
  return spec;
}

std::optional<std::size_t> Input::index_of(int subimage, int miplevel) const {
  const int count = static_cast<int>(levels_.size());
  const int index = is_atlas_ ? miplevel : subimage, other = is_atlas_ ? subimage : miplevel;
  if (other != 0 || index < 0 || index >= count) return std::nullopt;
  return static_cast<std::size_t>(index);
}

bool Input::seek_subimage(int subimage, int miplevel) {
  const auto index = index_of(subimage, miplevel);
  if (!index) return false;
  subimage_ = subimage;
  miplevel_ = miplevel;
  m_spec = specs_[*index];
  return true;
}

OIIO::ImageSpec Input::spec(int subimage, int miplevel) {
  const auto index = index_of(subimage, miplevel);
  return index ? specs_[*index] : OIIO::ImageSpec();
}

OIIO::ImageSpec Input::spec_dimensions(int subimage, int miplevel) {
  OIIO::ImageSpec dimensions;
  if (const auto index = index_of(subimage, miplevel)) dimensions.copy_dimensions(specs_[*index]);
  return dimensions;
}

bool Input::read_tiles(int subimage, int miplevel, int xbegin, int xend, int ybegin, int yend,
                       int zbegin, int zend, int chbegin, int chend, OIIO::TypeDesc format,
                       void* data, OIIO::stride_t xstride, OIIO::stride_t ystride,
                       OIIO::stride_t zstride) {
  const auto index = index_of(subimage, miplevel);
  if (!index) {
    errorfmt("subimage {}, level {} of its mipmap, expected a {} below {} and the other to be 0",
             subimage, miplevel, is_atlas_ ? "level" : "subimage", levels_.size());
    return false;
  }
  if (!specs_[*index].valid_tile_range(xbegin, xend, ybegin, yend, zbegin, zend)) {
    errorfmt("pixels {}-{}, {}-{}, {}-{}, expected whole tiles", xbegin, xend, ybegin, yend, zbegin,
             zend);
    return false;
  }
  const Target target{data, format, xstride, ystride, zstride, chbegin, chend};
  try {
    read_region(*texture_, *levels_[*index], specs_[*index],
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
