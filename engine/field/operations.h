// The operations that only move or make values: noise, upsampling, concatenation, output.
#pragma once

#include "engine/field/block.h"
#include "engine/noise/noise.h"

namespace solidtex::engine {

void fill_noise(NoiseScheme scheme, std::uint64_t seed, int level, Distribution distribution,
                const Block& out);

// out[i] = in[floor(i / 2)].
void upsample(const Block& in, const Block& out);

// Copies `in` to the channels of `out` from first_channel on.
void copy_channels(const Block& in, const Block& out, int first_channel);

// [channel][x][y][z] to [x][y][z][channel].
void interleave(const Block& in, float* values);

}  // namespace solidtex::engine
