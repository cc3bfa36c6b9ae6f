#include "engine/common/sha256.h"

#include <array>
#include <bit>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <vector>

#include "engine/common/error.h"

namespace solidtex::engine {
namespace {

using Word = std::uint32_t;

constexpr std::size_t block_bytes = 64;
constexpr std::size_t rounds = 64;

// Returns the first 32 bits of the fraction of the n-th root of `prime`, n is 2 or 3: the last bits
// of the largest r with r^n <= prime * 2^(32 n).
constexpr Word root_fraction(unsigned prime, int n) {
  __extension__ using Wide = unsigned __int128;
  std::uint64_t root = 0;
  for (int bit = 36; bit >= 0; --bit) {
    const std::uint64_t candidate = root | (std::uint64_t{1} << bit);
    Wide power = Wide{candidate} * candidate;
    if (n == 3) power *= candidate;
    if (power <= Wide{prime} << (32 * n)) root = candidate;
  }
  return static_cast<Word>(root);
}

constexpr std::array<unsigned, rounds> first_primes() {
  std::array<unsigned, rounds> primes{};
  std::size_t count = 0;
  for (unsigned candidate = 2; count < rounds; ++candidate) {
    bool is_prime = true;
    for (std::size_t i = 0; i < count; ++i) is_prime = is_prime && candidate % primes[i] != 0;
    if (is_prime) primes[count++] = candidate;
  }
  return primes;
}

template <std::size_t count>
constexpr std::array<Word, count> constants(int root) {
  const auto primes = first_primes();
  std::array<Word, count> result{};
  for (std::size_t i = 0; i < count; ++i) result[i] = root_fraction(primes[i], root);
  return result;
}

constexpr auto initial_state = constants<8>(2);
constexpr auto round_constants = constants<rounds>(3);

Word big_endian(const std::byte* bytes) {
  Word word = 0;
  for (int i = 0; i < 4; ++i) word = word << 8 | std::to_integer<Word>(bytes[i]);
  return word;
}

using State = std::array<Word, 8>;

void add_block(State& state, const std::byte* block) {
  std::array<Word, rounds> w{};
  for (std::size_t i = 0; i < 16; ++i) w[i] = big_endian(block + 4 * i);
  for (std::size_t i = 16; i < rounds; ++i) {
    const Word a = w[i - 15], b = w[i - 2];
    w[i] = w[i - 16] + (std::rotr(a, 7) ^ std::rotr(a, 18) ^ a >> 3) + w[i - 7] +
           (std::rotr(b, 17) ^ std::rotr(b, 19) ^ b >> 10);
  }
  auto [a, b, c, d, e, f, g, h] = state;
  for (std::size_t i = 0; i < rounds; ++i) {
    const Word one = h + (std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25)) +
                     ((e & f) ^ (~e & g)) + round_constants[i] + w[i];
    const Word two =
        (std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22)) + ((a & b) ^ (a & c) ^ (b & c));
    h = g, g = f, f = e, e = d + one, d = c, c = b, b = a, a = one + two;
  }
  const std::array<Word, 8> added{a, b, c, d, e, f, g, h};
  for (std::size_t i = 0; i < state.size(); ++i) state[i] += added[i];
}

void add_blocks(State& state, std::span<const std::byte> blocks) {
  for (std::size_t i = 0; i < blocks.size(); i += block_bytes) add_block(state, blocks.data() + i);
}

// The last bytes, a one bit, zeros, and the length in bits.
std::vector<std::byte> padded_tail(std::span<const std::byte> tail, std::uint64_t size) {
  std::vector<std::byte> result(tail.begin(), tail.end());
  result.push_back(std::byte{0x80});
  while (result.size() % block_bytes != block_bytes - 8) result.push_back(std::byte{0});
  for (int shift = 56; shift >= 0; shift -= 8)
    result.push_back(static_cast<std::byte>(size * 8 >> shift & 0xFF));
  return result;
}

// Adds the bytes that no whole block has.
std::string finish(State state, std::span<const std::byte> tail, std::uint64_t size) {
  add_blocks(state, padded_tail(tail, size));
  std::string digits;
  for (const Word word : state)
    for (int shift = 28; shift >= 0; shift -= 4) digits += "0123456789abcdef"[word >> shift & 15];
  return digits;
}

}  // namespace

std::string sha256(std::span<const std::byte> bytes) {
  State state = initial_state;
  const std::size_t whole = bytes.size() / block_bytes * block_bytes;
  add_blocks(state, bytes.first(whole));
  return finish(state, bytes.subspan(whole), bytes.size());
}

std::string file_sha256(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  State state = initial_state;
  std::vector<std::byte> chunk(1 << 20);
  std::uint64_t size = 0;
  while (file) {
    file.read(reinterpret_cast<char*>(chunk.data()), static_cast<std::streamsize>(chunk.size()));
    const auto count = static_cast<std::size_t>(file.gcount());
    size += count;
    if (file) {
      add_blocks(state, chunk);
    } else if (file.eof()) {
      const std::size_t whole = count / block_bytes * block_bytes;
      add_blocks(state, std::span(chunk).first(whole));
      return finish(state, std::span(chunk).first(count).subspan(whole), size);
    }
  }
  throw Error(SOLIDTEX_IO_ERROR, path.string() + ": cannot read: " + std::strerror(errno));
}

}  // namespace solidtex::engine
