#include "engine/sampler/matrix_network.h"

#include "engine/kernels/targets.h"
// After the choice of targets.
#include <hwy/targets.h>

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <new>

#if defined(__x86_64__) && defined(__linux__)
#ifndef __clang__  // GCC 12 warns about _mm512_undefined_ps
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#include <immintrin.h>
#include <sys/syscall.h>
#include <unistd.h>
#define SOLIDTEX_MATRIX_UNIT __attribute__((target("avx512f,amx-tile,amx-bf16")))
#endif

namespace solidtex::engine {
namespace {

constexpr int kTile = 16;                 // outputs or points per tile
constexpr int kStep = 2 * kTile;          // inputs per product of tiles
constexpr int kTileSize = kTile * kStep;  // weights per tile
// Octaves and their weights are split into two bfloat16 parts each, which halves the error. It is
// free: the few octaves of a layer do not fill a step. Inputs (low, high, low, high) meet weights
// (high, high, low, low).
constexpr int kOctaveInputs = 4;

constexpr int kGroup = 3;                  // tiles of points that share one load of weights
using Sums = float[kGroup][kTile][kTile];  // [tile of points][output][point]

int tiles_of(int count, int step) { return (count + step - 1) / step; }

// Rounds to nearest, ties away from zero, as the vectors do.
std::uint16_t to_bfloat16(float value) {
  return static_cast<std::uint16_t>((std::bit_cast<std::uint32_t>(value) + 0x8000u) >> 16);
}

float from_bfloat16(std::uint16_t bits) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(bits) << 16);
}

template <class Value>
hwy::AlignedFreeUniquePtr<Value[]> allocate_zeros(std::size_t count) {
  auto storage = hwy::AllocateAligned<Value>(std::max<std::size_t>(count, 1));
  if (!storage) throw std::bad_alloc();
  std::fill_n(storage.get(), count, Value{});
  return storage;
}

}  // namespace

MatrixNetwork::Layer MatrixNetwork::make_layer(const LinearLayer& linear, int units) {
  const int octaves = linear.terms - units;
  Layer layer{.output_tiles = tiles_of(linear.outputs, kTile),
              .octaves = octaves,
              .octave_steps = tiles_of(octaves * kOctaveInputs, kStep),
              .unit_steps = tiles_of(units, kStep),
              .weights = {},
              .bias = linear.bias,
              .negative_slope = linear.negative_slope};
  const int steps = layer.octave_steps + layer.unit_steps;
  layer.weights = allocate_zeros<std::uint16_t>(static_cast<std::size_t>(layer.output_tiles) *
                                                steps * kTileSize);
  layer.bias.resize(static_cast<std::size_t>(layer.output_tiles) * kTile);
  for (int o = 0; o < linear.outputs; ++o) {
    const auto set = [&](int input, std::uint16_t weight) {
      const std::size_t tile = static_cast<std::size_t>(o / kTile) * steps + input / kStep;
      layer.weights[(tile * kTile + o % kTile) * kStep + input % kStep] = weight;
    };
    for (int t = 0; t < units; ++t)
      set(layer.octave_steps * kStep + t, to_bfloat16(linear.weight(o, t)));
    for (int i = 0; i < octaves; ++i) {
      const float weight = linear.weight(o, units + i);
      const std::uint16_t high = to_bfloat16(weight);
      const std::uint16_t low = to_bfloat16(weight - from_bfloat16(high));
      const std::uint16_t inputs[kOctaveInputs] = {high, high, low, low};
      for (int k = 0; k < kOctaveInputs; ++k) set(i * kOctaveInputs + k, inputs[k]);
    }
  }
  return layer;
}

MatrixNetwork::MatrixNetwork(std::span<const LinearLayer> layers) {
  int units = 0;
  for (const LinearLayer& layer : layers) {
    layers_.push_back(make_layer(layer, units));
    units = layer.outputs;
  }
  int octave_steps = 0, unit_steps = 0;
  for (const Layer& layer : layers_) {
    octaves_ += layer.octaves;
    octave_steps = std::max(octave_steps, layer.octave_steps);
    unit_steps = std::max(unit_steps, layer.unit_steps);
  }
  octave_rows_ = static_cast<std::size_t>(octave_steps) * kTile;
  rows_ = octave_rows_ + static_cast<std::size_t>(unit_steps) * kTile;
}

MatrixNetwork::Block::Block(const MatrixNetwork& network, int points)
    : pitch_(tiles_of(points, kTile) * kTile) {
  const auto columns = static_cast<std::size_t>(pitch_);
  const int unit_rows = network.layers_.back().output_tiles * kTile;
  octaves_ = allocate_zeros<float>(static_cast<std::size_t>(network.octaves_) * columns);
  units_ = allocate_zeros<float>(static_cast<std::size_t>(unit_rows) * columns);
  current_ = allocate_zeros<std::uint32_t>(network.rows_ * columns);
  next_ = allocate_zeros<std::uint32_t>(network.rows_ * columns);
}

#ifdef SOLIDTEX_MATRIX_UNIT

namespace {

struct alignas(64) TileConfiguration {
  std::uint8_t palette = 1, first_row = 0, reserved[14] = {};
  std::uint16_t row_bytes[16] = {64, 64, 64, 64, 64, 64, 64, 64};
  std::uint8_t rows[16] = {16, 16, 16, 16, 16, 16, 16, 16};
};

// Requests the unit's registers from Linux.
bool request_tiles() {
  constexpr int kRequestPermission = 0x1023, kTileData = 18;
  if (!__builtin_cpu_supports("avx512f")) return false;
  unsigned a = 0, b = 0, c = 0, d = 0;
  __asm__("cpuid" : "=a"(a), "=b"(b), "=c"(c), "=d"(d) : "a"(7), "c"(0));
  constexpr unsigned kBf16 = 1u << 22, kTiles = 1u << 24;
  if ((d & kBf16) == 0 || (d & kTiles) == 0) return false;
  return syscall(SYS_arch_prctl, kRequestPermission, kTileData) == 0;
}

// Packs two rows of inputs into one row of pairs, the first input in the low half.
SOLIDTEX_MATRIX_UNIT inline __m512i pair_of(__m512 first, __m512 second) {
  const __m512i half = _mm512_set1_epi32(0x8000), high = _mm512_set1_epi32(-0x10000);
  const __m512i low = _mm512_srli_epi32(_mm512_add_epi32(_mm512_castps_si512(first), half), 16);
  const __m512i top = _mm512_add_epi32(_mm512_castps_si512(second), half);
  return _mm512_ternarylogic_epi32(low, top, high, 0xF8);  // low | (top & high)
}

// Splits octaves [count][pitch] into pairs of parts, each pair twice: [2 * count][pitch].
SOLIDTEX_MATRIX_UNIT void split_octaves(const float* octaves, int count, int points, int pitch,
                                        std::uint32_t* pairs) {
  const __m512i half = _mm512_set1_epi32(0x8000), high_bits = _mm512_set1_epi32(-0x10000);
  for (int i = 0; i < count; ++i, octaves += pitch, pairs += 2 * pitch)
    for (int p = 0; p < points; p += kTile) {
      const __m512 value = _mm512_load_ps(octaves + p);
      const __m512i rounded = _mm512_add_epi32(_mm512_castps_si512(value), half);
      const __m512 high = _mm512_castsi512_ps(_mm512_and_epi32(rounded, high_bits));
      const __m512i pair = pair_of(_mm512_sub_ps(value, high), high);
      _mm512_store_si512(pairs + p, pair);
      _mm512_store_si512(pairs + pitch + p, pair);
    }
}

// Sums one tile of outputs for kTiles tiles of points.
template <int kTiles>
SOLIDTEX_MATRIX_UNIT inline void sum_tiles(const std::uint16_t* weights, int steps,
                                           const std::uint32_t* inputs, int pitch, Sums& sums) {
  const auto row_bytes = static_cast<std::ptrdiff_t>(pitch * sizeof(std::uint32_t));
  _tile_zero(0);
  if (kTiles > 1) _tile_zero(1);
  if (kTiles > 2) _tile_zero(2);
  for (int s = 0; s < steps; ++s, weights += kTileSize, inputs += kTile * pitch) {
    _tile_loadd(3, weights, kStep * sizeof(std::uint16_t));
    _tile_loadd(4, inputs, row_bytes);
    _tile_dpbf16ps(0, 3, 4);
    if (kTiles > 1) {
      _tile_loadd(5, inputs + kTile, row_bytes);
      _tile_dpbf16ps(1, 3, 5);
    }
    if (kTiles > 2) {
      _tile_loadd(6, inputs + 2 * kTile, row_bytes);
      _tile_dpbf16ps(2, 3, 6);
    }
  }
  _tile_stored(0, sums[0], kTile * sizeof(float));
  if (kTiles > 1) _tile_stored(1, sums[1], kTile * sizeof(float));
  if (kTiles > 2) _tile_stored(2, sums[2], kTile * sizeof(float));
}

SOLIDTEX_MATRIX_UNIT void sum_tiles(int tiles, const std::uint16_t* weights, int steps,
                                    const std::uint32_t* inputs, int pitch, Sums& sums) {
  if (tiles == 1) return sum_tiles<1>(weights, steps, inputs, pitch, sums);
  if (tiles == 2) return sum_tiles<2>(weights, steps, inputs, pitch, sums);
  sum_tiles<3>(weights, steps, inputs, pitch, sums);
}

SOLIDTEX_MATRIX_UNIT inline __m512 activated(const float* sums, float bias, __m512 negative_slope) {
  const __m512 sum = _mm512_add_ps(_mm512_load_ps(sums), _mm512_set1_ps(bias));
  return _mm512_max_ps(sum, _mm512_mul_ps(sum, negative_slope));
}

SOLIDTEX_MATRIX_UNIT void store_pairs(const Sums& sums, const float* bias, __m512 negative_slope,
                                      int tiles, int pitch, std::uint32_t* pairs) {
  for (int o = 0; o < kTile; o += 2)
    for (int t = 0; t < tiles; ++t)
      _mm512_store_si512(pairs + o / 2 * pitch + t * kTile,
                         pair_of(activated(sums[t][o], bias[o], negative_slope),
                                 activated(sums[t][o + 1], bias[o + 1], negative_slope)));
}

SOLIDTEX_MATRIX_UNIT void store_values(const Sums& sums, const float* bias, __m512 negative_slope,
                                       int tiles, int pitch, float* values) {
  for (int o = 0; o < kTile; ++o)
    for (int t = 0; t < tiles; ++t)
      _mm512_store_ps(values + o * pitch + t * kTile,
                      activated(sums[t][o], bias[o], negative_slope));
}

}  // namespace

bool MatrixNetwork::supported() {
  static const bool available = request_tiles();
  return available && kernels::active_target() <= HWY_AVX3;  // better ones have lower numbers
}

SOLIDTEX_MATRIX_UNIT void MatrixNetwork::run_layer(const Layer& layer, int point_tiles, int pitch,
                                                   const std::uint32_t* inputs,
                                                   std::uint32_t* pairs, float* values) {
  alignas(64) Sums sums;
  const int steps = layer.octave_steps + layer.unit_steps;
  const __m512 negative_slope = _mm512_set1_ps(layer.negative_slope);
  for (int tile = 0; tile < layer.output_tiles; ++tile) {
    const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(tile) * kTile;
    const std::uint16_t* weights = layer.weights.get() + row * steps * kStep;
    for (int first = 0; first < point_tiles; first += kGroup) {
      const int tiles = std::min(kGroup, point_tiles - first), point = first * kTile;
      sum_tiles(tiles, weights, steps, inputs + point, pitch, sums);
      if (values) {
        store_values(sums, &layer.bias[row], negative_slope, tiles, pitch,
                     values + row * pitch + point);
      } else {
        store_pairs(sums, &layer.bias[row], negative_slope, tiles, pitch,
                    pairs + row / 2 * pitch + point);
      }
    }
  }
}

SOLIDTEX_MATRIX_UNIT void MatrixNetwork::evaluate(int count, Block& block) const {
  const TileConfiguration configuration;
  _tile_loadconfig(&configuration);
  const int point_tiles = tiles_of(count, kTile), pitch = block.pitch();
  const std::size_t unit_row = octave_rows_ * static_cast<std::size_t>(pitch);
  int octave = 0;
  for (const Layer& layer : layers_) {
    // Octaves end where units begin, at the same row in every layer.
    const std::ptrdiff_t octave_pairs = static_cast<std::ptrdiff_t>(layer.octave_steps) * kTile;
    std::uint32_t* inputs = block.current_.get() + unit_row - octave_pairs * pitch;
    split_octaves(block.octave(octave), layer.octaves, point_tiles * kTile, pitch, inputs);
    octave += layer.octaves;
    run_layer(layer, point_tiles, pitch, inputs, block.next_.get() + unit_row,
              &layer == &layers_.back() ? block.units_.get() : nullptr);
    std::swap(block.current_, block.next_);
  }
  _tile_release();
}

#else

bool MatrixNetwork::supported() { return false; }

void MatrixNetwork::evaluate(int, Block&) const { std::abort(); }  // never called

#endif

}  // namespace solidtex::engine
