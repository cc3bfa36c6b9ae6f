// Writes noise as raw numbers for the statistical batteries: 32-bit words in the order asked for.
//
//   noise_stream SCHEME ORDER COUNT [SEED]
// SCHEME  solidtex-1, or solidtexturenets (its top 32 bits)
// ORDER   x, y, z: a line along the axis, then the next line; channel, level, seed: that one
// fastest;
//         cube: blocks of 64^3
// COUNT   number of words, 0 for no end
//
//   noise_stream normal FIRST STEP COUNT    normals of the words FIRST, FIRST + STEP ... as float32
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "engine/noise/hash.h"
#include "engine/noise/normal.h"

namespace {

using namespace solidtex::engine;

constexpr std::uint64_t kLine = 1 << 16;  // length of a line, and number of places beside it

struct Place {
  std::uint64_t seed;
  std::uint32_t level, channel, x, y, z;
};

// The i-th place of an order: the named coordinate runs fastest, around the origin.
Place place_of(const std::string& order, std::uint64_t seed, std::uint64_t i) {
  const auto fast = static_cast<std::uint32_t>(i % kLine - kLine / 2);
  const auto slow = static_cast<std::uint32_t>(i / kLine);
  const std::uint32_t near = slow % 256 - 128, far = slow / 256;
  if (order == "x") return {seed, 0, 0, fast, near, far};
  if (order == "y") return {seed, 0, 0, near, fast, far};
  if (order == "z") return {seed, 0, 0, near, far, fast};
  const auto at = static_cast<std::uint32_t>(i / 16);
  const std::uint32_t x = at / 65536, y = at / 256 % 256, z = at % 256;
  if (order == "channel") return {seed, 0, static_cast<std::uint32_t>(i % 16), x, y, z};
  if (order == "level") return {seed, static_cast<std::uint32_t>(i % 16), 0, x, y, z};
  if (order == "seed") return {seed + i % 16, 0, 0, x, y, z};
  if (order == "cube") {
    const auto v = static_cast<std::uint32_t>(i), block = static_cast<std::uint32_t>(i >> 18);
    return {seed, 0, 0, v >> 12 & 63, v >> 6 & 63, (v & 63) + 64 * block};
  }
  std::fprintf(stderr, "unknown order '%s'\n", order.c_str());
  std::exit(2);
}

std::uint32_t word_at(bool ours, const Place& p) {
  if (ours) return solidtex_1_bits(make_stream_key(p.seed, p.level, p.channel), p.x, p.y, p.z);
  return static_cast<std::uint32_t>(
      solidtexturenets_bits(p.seed, p.level, p.channel, p.x, p.y, p.z) >> 32);
}

template <class Word, class Make>
int stream(std::uint64_t count, Make make) {
  std::vector<Word> block(1 << 14);
  for (std::uint64_t done = 0; count == 0 || done < count; done += block.size()) {
    if (count != 0 && count - done < block.size()) block.resize(count - done);
    for (std::size_t i = 0; i < block.size(); ++i) block[i] = make(done + i);
    if (std::fwrite(block.data(), sizeof(Word), block.size(), stdout) != block.size()) return 0;
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: noise_stream SCHEME ORDER COUNT [SEED]\n");
    return 2;
  }
  const std::string scheme = argv[1], order = argv[2];
  const auto number = [&](int i) { return std::strtoull(argv[i], nullptr, 0); };
  if (scheme == "normal" && argc == 5)
    return stream<float>(number(4), [&, first = number(2), step = number(3)](std::uint64_t i) {
      return normal_from_bits(static_cast<std::uint32_t>(first + i * step));
    });
  if (scheme != "solidtex-1" && scheme != "solidtexturenets") {
    std::fprintf(stderr, "unknown scheme '%s'\n", scheme.c_str());
    return 2;
  }
  const std::uint64_t seed = argc > 4 ? number(4) : 0;
  return stream<std::uint32_t>(number(3), [&](std::uint64_t i) {
    return word_at(scheme == "solidtex-1", place_of(order, seed, i));
  });
}
