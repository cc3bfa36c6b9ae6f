// Removes noise from rendered images by Open Image Denoise.
#pragma once

#include <solidtex/image.hpp>

namespace solidtex::pathtracer {

// Removes the noise of the beauty, guided by albedo and normal, which keep their values. Throws
// std::invalid_argument if the image lacks one of the three, and std::runtime_error if the library
// is not found or fails.
void denoise(AovImage& image);

// Throws std::runtime_error, with what to do, if Open Image Denoise is not found.
void check_denoiser();

}  // namespace solidtex::pathtracer
