// Writes noise as raw numbers for the statistical batteries.
//
//   noise_stream words|normals SCHEME ORDER COUNT [SEED [LEVEL [CHANNEL]]]
// words     32-bit words (of solidtexturenets: its top 32 bits); normals: float32
// ORDER     x, y, z: a line along the axis, then the next line; channel, level, seed: that one runs
//           fastest; cube: blocks of 64^3; stride: the cube with all coordinates times 65536
// COUNT     how many, 0 for no end
//
//   noise_stream quantiles FIRST STEP COUNT    normals made of the words FIRST, FIRST + STEP ...
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "engine/noise/hash.h"
#include "engine/noise/normal.h"

namespace {

using namespace solidtex::engine;

struct Place {
  std::uint64_t seed = 0;
  std::uint32_t level = 0, channel = 0, x = 0, y = 0, z = 0;
};

[[noreturn]] void refuse(const std::string& what, const std::string& found) {
  std::fprintf(stderr, "noise_stream: unknown %s '%s'\n", what.c_str(), found.c_str());
  std::exit(2);
}

// The i-th place of an order. Lines are 65536 long and cross the origin.
Place place_of(const std::string& order, Place at, std::uint64_t i) {
  const auto fast = static_cast<std::uint32_t>(i % 65536 - 32768);
  const auto line = static_cast<std::uint32_t>(i / 65536);
  const std::uint32_t near = line % 256 - 128, far = line / 256;
  if (order == "x") at.x = fast, at.y = near, at.z = far;
  if (order == "y") at.x = near, at.y = fast, at.z = far;
  if (order == "z") at.x = near, at.y = far, at.z = fast;
  if (order == "channel" || order == "level" || order == "seed") {
    const auto which = static_cast<std::uint32_t>(i % 16), v = static_cast<std::uint32_t>(i / 16);
    at.x = v >> 16, at.y = v >> 8 & 255, at.z = v & 255;
    if (order == "channel") at.channel += which;
    if (order == "level") at.level += which;
    if (order == "seed") at.seed += which;
  }
  if (order == "cube" || order == "stride") {
    const auto v = static_cast<std::uint32_t>(i), block = static_cast<std::uint32_t>(i >> 18);
    at.x = v >> 12 & 63, at.y = v >> 6 & 63, at.z = (v & 63) + 64 * block;
    if (order == "stride") at.x <<= 16, at.y <<= 16, at.z <<= 16;
  }
  return at;
}

std::uint32_t word_at(bool ours, const Place& p) {
  if (ours) return solidtex_1_bits(make_stream_key(p.seed, p.level, p.channel), p.x, p.y, p.z);
  return static_cast<std::uint32_t>(
      solidtexturenets_bits(p.seed, p.level, p.channel, p.x, p.y, p.z) >> 32);
}

// Writes make(0), make(1) ... until the count or the reader ends.
template <class Make>
void write(std::uint64_t count, Make make) {
  std::vector<decltype(make(0))> block;
  for (std::uint64_t i = 0; count == 0 || i < count;) {
    block.clear();
    for (; block.size() < 16384 && (count == 0 || i < count); ++i) block.push_back(make(i));
    if (std::fwrite(block.data(), sizeof block[0], block.size(), stdout) != block.size()) return;
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  const auto number = [&](std::size_t i) {
    return i < arguments.size() ? std::strtoull(arguments[i].c_str(), nullptr, 0) : 0;
  };
  if (arguments.size() < 4) refuse("usage, see noise_stream.cpp;", "too few arguments");
  const std::string &kind = arguments[0], &scheme = arguments[1], &order = arguments[2];
  if (kind == "quantiles") {
    write(number(3), [first = number(1), step = number(2)](std::uint64_t i) {
      return normal_from_bits(static_cast<std::uint32_t>(first + i * step));
    });
    return 0;
  }
  if (kind != "words" && kind != "normals") refuse("kind", kind);
  if (scheme != "solidtex-1" && scheme != "solidtexturenets") refuse("scheme", scheme);
  if (std::string(" x y z channel level seed cube stride ").find(' ' + order + ' ') ==
      std::string::npos)
    refuse("order", order);
  Place start;
  start.seed = number(4);
  start.level = static_cast<std::uint32_t>(number(5));
  start.channel = static_cast<std::uint32_t>(number(6));
  const auto word = [&](std::uint64_t i) {
    return word_at(scheme == "solidtex-1", place_of(order, start, i));
  };
  if (kind == "words") write(number(3), word);
  if (kind == "normals")
    write(number(3), [&](std::uint64_t i) { return normal_from_bits(word(i)); });
  return 0;
}
