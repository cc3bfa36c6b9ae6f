// The sRGB transfer function (IEC 61966-2-1), shared by plugins and tools.
#pragma once

#include <cmath>

namespace solidtex {

inline float srgb_to_linear(float encoded) {
  if (!(encoded > 0.04045f)) return encoded / 12.92f;
  return std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

inline float linear_to_srgb(float linear) {
  if (!(linear > 0.0031308f)) return linear * 12.92f;
  return 1.055f * std::pow(linear, 1 / 2.4f) - 0.055f;
}

}  // namespace solidtex
