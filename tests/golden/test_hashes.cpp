// The same bits everywhere and for ever: queries of models/ give the hashes of hashes.txt on every
// target of this machine. Shipped models are trained anew now and then; these stay.
// `solidtex_golden "[print]"` writes the table with the hashes of this machine.
#include <array>
#include <bit>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "catch.hpp"
#include "engine/query/texture.h"
#include "every_target.h"

namespace se = solidtex::engine;

namespace {

constexpr std::uint64_t kCacheBytes = 256u << 20;
constexpr std::size_t kPoints = 100;

// A line of the table: points have random offsets of up to 8 texels from their origin.
struct Row {
  std::string model;
  std::uint64_t seed = 0;
  std::string query;  // "box" or "points"
  std::array<std::int64_t, 3> origin{};
  std::array<std::int64_t, 3> size{};  // of a box
  std::string hash;
};

std::istream& operator>>(std::istream& line, Row& row) {
  line >> row.model >> row.seed >> row.query;
  for (auto& value : row.origin) line >> value;
  if (row.query == "box")
    for (auto& value : row.size) line >> value;
  return line >> row.hash;
}

std::vector<Row> table() {
  std::ifstream file(SOLIDTEX_GOLDEN_FOLDER "/hashes.txt");
  std::vector<Row> rows;
  for (std::string text; std::getline(file, text);) {
    if (text.empty() || text[0] == '#') continue;
    std::istringstream line(text);
    INFO(text);
    Row row;
    REQUIRE(line >> row);
    rows.push_back(row);
  }
  return rows;
}

// FNV-1a of the values' bits, the low byte first: the same on machines of either byte order.
std::string hash_of(const std::vector<float>& values) {
  std::uint64_t hash = 0xCBF29CE484222325u;
  for (const float value : values)
    for (int shift = 0; shift < 32; shift += 8)
      hash = (hash ^ (std::bit_cast<std::uint32_t>(value) >> shift & 0xFF)) * 0x100000001B3u;
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(hash));
  return text.data();
}

// Multiples of 1/256 from 0 to 8, by a formula of integers alone.
std::vector<float> offsets() {
  std::vector<float> points(3 * kPoints);
  for (std::uint32_t i = 0; i < points.size(); ++i)
    points[i] = static_cast<float>((i + 1) * 2654435761u >> 21) / 256.0f;
  return points;
}

std::string evaluate(const se::Texture& texture, const Row& row) {
  const std::size_t channels = texture.model().channels.size();
  if (row.query == "box") {
    const auto voxels = static_cast<std::size_t>(row.size[0] * row.size[1] * row.size[2]);
    std::vector<float> values(voxels * channels);
    texture.eval_box(row.origin.data(), row.size.data(), values.data());
    return hash_of(values);
  }
  const std::vector<float> points = offsets();
  const std::array<double, 3> origin{static_cast<double>(row.origin[0]),
                                     static_cast<double>(row.origin[1]),
                                     static_cast<double>(row.origin[2])};
  std::vector<float> values(kPoints * channels);
  texture.eval(origin.data(), points.data(), {}, kPoints, values.data());
  return hash_of(values);
}

// Calls check(row, hash) for each row. Rows of one model and seed follow each other.
template <class Check>
void for_each_row(Check check) {
  std::unique_ptr<se::Texture> texture;
  std::string key;
  for (const Row& row : table()) {
    const std::string wanted = row.model + " " + std::to_string(row.seed);
    if (wanted != key) {
      const auto path = std::string(SOLIDTEX_GOLDEN_FOLDER "/models/") + row.model + ".solidtex";
      texture = std::make_unique<se::Texture>(se::read_model(path), row.seed, kCacheBytes);
      key = wanted;
    }
    check(row, evaluate(*texture, row));
  }
}

std::string first_columns(const Row& row) {
  std::ostringstream text;
  text << row.model << " " << row.seed << " " << row.query;
  for (const auto value : row.origin) text << " " << value;
  if (row.query == "box")
    for (const auto value : row.size) text << " " << value;
  return text.str();
}

}  // namespace

TEST_CASE("golden: models have the hashes of the table on every target", "[golden]") {
  CHECK(table().size() == 29);
  testing::on_every_target([] {
    for_each_row([](const Row& row, const std::string& hash) {
      INFO(first_columns(row));
      CHECK(hash == row.hash);
    });
  });
}

TEST_CASE("golden: print", "[.][print]") {
  for_each_row([](const Row& row, const std::string& hash) {
    std::printf("%s %s\n", first_columns(row).c_str(), hash.c_str());
  });
}
