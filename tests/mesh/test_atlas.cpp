// An atlas has the same bits in any region, also where it goes on beyond its edges.
#include <cmath>
#include <cstring>
#include <random>

#include "catch.hpp"
#include "plugins/mesh/atlas.h"

using namespace solidtex::mesh;

namespace {

constexpr int kSize = 200;

// Triangles here and there in the atlas, some of them slivers, some on top of others.
std::shared_ptr<const Mesh> scattered(unsigned seed) {
  std::mt19937 random(seed);
  const auto number = [&] { return static_cast<float>(random() % 1000) / 1000; };
  auto mesh = std::make_shared<Mesh>();
  mesh->file = "scattered";
  for (unsigned t = 0; t < 30; ++t) {
    const glm::vec2 middle(0.1f + 0.8f * number(), 0.1f + 0.8f * number());
    for (int corner = 0; corner < 3; ++corner) {
      mesh->positions.emplace_back(number(), number(), number());
      mesh->uvs.push_back(middle + 0.2f * glm::vec2(number() - 0.5f, number() - 0.5f));
    }
    mesh->triangles.emplace_back(3 * t, 3 * t + 1, 3 * t + 2);
  }
  return mesh;
}

std::vector<float> values_of(const Atlas& atlas, const solidtex::texture& texture,
                             const AtlasRegion& region) {
  std::vector<float> values(static_cast<std::size_t>(region.width()) *
                            static_cast<std::size_t>(region.height()) * texture.channel_count());
  atlas.evaluate(texture, region, values.data());
  return values;
}

}  // namespace

TEST_CASE("an atlas is the same in any region") {
  const solidtex::texture texture("granite-speckled");
  for (const int margin : {0, 3, 20}) {
    const Atlas atlas(scattered(5), {{1, -2, 1e6}, 30}, kSize, margin);
    const auto whole = values_of(atlas, texture, {{0, 0}, {kSize, kSize}});
    std::mt19937 random(9);
    for (int trial = 0; trial < 12; ++trial) {
      AtlasRegion part;
      for (std::size_t axis = 0; axis < 2; ++axis) {
        part.low[axis] = static_cast<int>(random() % kSize);
        part.high[axis] = part.low[axis] + 1 + static_cast<int>(random() % 70);
        part.high[axis] = std::min(part.high[axis], kSize);
      }
      const auto values = values_of(atlas, texture, part);
      const auto width = static_cast<std::size_t>(part.width()) * 3;
      for (int y = part.low[1]; y < part.high[1]; ++y) {
        const auto row = static_cast<std::size_t>(y - part.low[1]) * width;
        const auto at = 3 * static_cast<std::size_t>(y * kSize + part.low[0]);
        REQUIRE(std::memcmp(&values[row], &whole[at], width * sizeof(float)) == 0);
      }
    }
  }
}

TEST_CASE("neighboring triangles leave no gap, and do not count as overlapping") {
  // A square turned by some angle, cut along its diagonal: many centers near that line.
  auto mesh = std::make_shared<Mesh>();
  const float c = 0.4f * std::cos(0.3f), s = 0.4f * std::sin(0.3f);
  const glm::vec2 corners[] = {{c, s}, {-s, c}, {-c, -s}, {s, -c}};
  for (const glm::vec2& corner : corners) {
    mesh->uvs.push_back(0.5f + corner);
    mesh->positions.emplace_back(corner, 0);
  }
  mesh->triangles = {{0, 1, 2}, {0, 2, 3}};
  const solidtex::texture texture("granite-speckled");
  const Atlas atlas(mesh, {}, kSize, 0);
  const AtlasRegion whole{{0, 0}, {kSize, kSize}};
  const auto values = values_of(atlas, texture, whole);
  std::size_t inside = 0;
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const glm::vec2 p = glm::vec2(x + 0.5f, kSize - y - 0.5f) / float(kSize) - 0.5f;
      const glm::vec2 along(glm::dot(p, corners[0] - corners[1]),
                            glm::dot(p, corners[1] - corners[2]));
      const float half = 0.5f * glm::dot(corners[0] - corners[1], corners[0] - corners[1]);
      if (std::max(std::abs(along.x), std::abs(along.y)) > 0.99f * half) continue;
      ++inside;
      REQUIRE(values[3 * static_cast<std::size_t>(y * kSize + x)] != 0.0f);
    }
  CHECK(inside > 10000);
  CHECK(atlas.overlapping_texels(whole) == 0);
  mesh->triangles.emplace_back(0, 1, 3);
  CHECK(Atlas(mesh, {}, kSize, 0).overlapping_texels(whole) > 1000);
}

TEST_CASE("a mesh without an atlas is refused") {
  auto mesh = std::make_shared<Mesh>(*scattered(1));
  mesh->uvs[7].x = -0.01f;
  CHECK_THROWS_AS(Atlas(mesh, {}, kSize), MeshError);
  mesh->uvs.clear();
  CHECK_THROWS_AS(Atlas(mesh, {}, kSize), MeshError);
}
