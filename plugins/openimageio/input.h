// The reader that OpenImageIO sees: a model file and a query as a tiled image.
#pragma once

#include <OpenImageIO/imageio.h>

#include <memory>
#include <optional>
#include <solidtex/solidtex.hpp>
#include <string>
#include <vector>

#include "plugins/openimageio/level.h"
#include "plugins/openimageio/query.h"

namespace solidtex::openimageio {

// Subimages are the levels of detail of a volume, named lod0, lod1 ...; the UV atlas of a mesh is
// one subimage with a mipmap. Reads that name their subimage take no lock and may run on any number
// of threads. "procedural" is not a supported feature: it would make oiiotool 2.4 crash on refused
// names.
class Input final : public OIIO::ImageInput {
 public:
  const char* format_name() const override { return "solidtex"; }
  bool valid_file(const std::string& name) const override;
  bool open(const std::string& name, OIIO::ImageSpec& spec) override;
  bool close() override;

  int current_subimage() const override { return subimage_; }
  int current_miplevel() const override { return miplevel_; }
  bool seek_subimage(int subimage, int miplevel) override;
  OIIO::ImageSpec spec(int subimage, int miplevel) override;
  OIIO::ImageSpec spec_dimensions(int subimage, int miplevel) override;
  const OIIO::ImageSpec& spec() const override { return m_spec; }

  using OIIO::ImageInput::read_tiles;
  bool read_tiles(int subimage, int miplevel, int xbegin, int xend, int ybegin, int yend,
                  int zbegin, int zend, int chbegin, int chend, OIIO::TypeDesc format, void* data,
                  OIIO::stride_t xstride, OIIO::stride_t ystride, OIIO::stride_t zstride) override;
  bool read_native_tile(int subimage, int miplevel, int x, int y, int z, void* data) override;
  bool read_native_scanline(int subimage, int miplevel, int y, int z, void* data) override;

 private:
  // Index of a level; nothing where it does not exist.
  std::optional<std::size_t> index_of(int subimage, int miplevel) const;
  void open_volume(const Query& query);
  void open_atlas(const Query& query);
  OIIO::ImageSpec spec_of(const Query& query, const Level& level) const;

  std::optional<texture> texture_;
  std::vector<std::unique_ptr<const Level>> levels_;
  std::vector<OIIO::ImageSpec> specs_;  // one for each level
  bool is_atlas_ = false;
  int subimage_ = 0, miplevel_ = 0;  // current
};

}  // namespace solidtex::openimageio
