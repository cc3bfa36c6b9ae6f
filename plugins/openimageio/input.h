// The reader that OpenImageIO sees: a model file and a query as a tiled image.
#pragma once

#include <OpenImageIO/imageio.h>

#include <optional>
#include <solidtex/solidtex.hpp>
#include <string>
#include <vector>

#include "plugins/openimageio/level.h"
#include "plugins/openimageio/query.h"

namespace solidtex::openimageio {

// Subimages are the levels of detail, named lod0, lod1 ... . Reads that name their subimage take no
// lock and may run on any number of threads, as OpenImageIO promises its callers. "procedural" is
// not among what it supports: that changes nothing but makes oiiotool 2.4 crash on refused names.
class Input final : public OIIO::ImageInput {
 public:
  const char* format_name() const override { return "solidtex"; }
  bool valid_file(const std::string& name) const override;
  bool open(const std::string& name, OIIO::ImageSpec& spec) override;
  bool close() override;

  int current_subimage() const override { return current_; }
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
  bool is_there(int subimage, int miplevel) const;
  OIIO::ImageSpec spec_of(const Query& query, const Level& level) const;

  std::optional<texture> texture_;
  std::vector<Level> levels_;
  std::vector<OIIO::ImageSpec> specs_;  // one a level
  int current_ = 0;
};

}  // namespace solidtex::openimageio
