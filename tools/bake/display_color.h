// What a texture looks like: the linear colour of a point's channels.
#pragma once

#include <algorithm>

#include "tools/bake/channel_groups.h"
#include "tools/bake/cut_cube.h"
#include "tools/bake/image.h"

namespace solidtex::tools {

// Shows one group of channels; single channels and plain data as they are, in grey.
class DisplayColor {
 public:
  DisplayColor(const solidtex::texture& texture, const std::string& group)
      : group_(channel_group(texture, group)) {}

  Vec3 operator()(const float* values) const {
    Vec3 color;
    for (std::size_t i = 0; i < 3; ++i) {
      const float value =
          std::clamp(values[group_.channels[i % group_.channels.size()]], 0.0f, 1.0f);
      color[i] = group_.encoding == Encoding::linear ? value : srgb_to_linear(value);
    }
    return color;
  }

 private:
  ChannelGroup group_;
};

}  // namespace solidtex::tools
