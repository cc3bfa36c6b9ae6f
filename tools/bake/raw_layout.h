// Files of uncompressed voxels between texts: where each part lies. Voxels can be written in any
// order, so that memory is bounded by a piece.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "tools/bake/output.h"

namespace solidtex::tools {

// Some channels of all voxels: [z][y][x][channel].
struct RawBlock {
  std::vector<std::size_t> channels;  // indices in the model
  std::uint64_t offset;
  std::uint64_t slice_step;  // bytes from a slice to the next
};

struct RawText {
  std::uint64_t offset;
  std::string bytes;
};

struct RawLayout {
  std::vector<RawBlock> blocks;
  std::vector<RawText> texts;
  std::string header{};  // of a file beside the voxels

  // Adds the bytes of a block: all slices of it one after another. Returns its end.
  std::uint64_t add_block(const Output& output, const Volume& volume,
                          std::vector<std::size_t> channels, std::uint64_t offset);
};

// The text with the letters escaped that XML gives a meaning.
std::string xml_text(const std::string& text);

// Header and voxels in one file, or, for .nhdr, the voxels alone.
RawLayout nrrd_layout(const Output& output, const Volume& volume);

// Voxels alone.
RawLayout plain_layout(const Output& output, const Volume& volume);

// VTK's XML image data, with an array of point data for each channel group.
RawLayout vti_layout(const Output& output, const Volume& volume);

// Grid volume of Mitsuba 3.
RawLayout mitsuba_layout(const Output& output, const Volume& volume);

// A page for each slice, with OME-XML; or, for ImageJ, a page for each slice and channel. BigTIFF
// where it takes more than 4 GiB.
RawLayout tiff_layout(const Output& output, const Volume& volume);

}  // namespace solidtex::tools
