// Which pictures of a sequence are to be made, and what they are called.
#pragma once

#include <filesystem>
#include <vector>

#include "tools/render/options.h"

namespace solidtex::tools {

struct Frame {
  int number = 0;
  std::filesystem::path output;
};

// Those that are left to do: all that are asked for, without those that exist if that was asked
// for. Throws for frames that the sequence does not have and for names that would be one file.
std::vector<Frame> frames_to_render(const Options& options, int frame_count);

}  // namespace solidtex::tools
