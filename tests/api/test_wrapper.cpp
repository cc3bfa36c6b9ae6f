// solidtex.hpp over the shared library: facts, and the values of solidtex.h.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <solidtex/solidtex.hpp>
#include <thread>
#include <vector>

#include "catch.hpp"
#include "tiny_model.h"

namespace {

std::vector<float> box_of(const solidtex::texture& texture,
                          const std::array<std::int64_t, 3>& origin, std::int64_t edge) {
  std::vector<float> values(static_cast<std::size_t>(edge * edge * edge) * texture.channel_count());
  texture.eval_box(origin, {edge, edge, edge}, values);
  return values;
}

template <class Call>
std::string refusal(Call call) {
  try {
    call();
  } catch (const solidtex::error& error) {
    CHECK(error.status() == SOLIDTEX_INVALID_ARGUMENT);
    return error.what();
  }
  return "no exception";
}

}  // namespace

TEST_CASE("wrapper: facts of both families", "[api]") {
  const auto field = solidtex::texture::from_memory(tiny_lattice_file(), {.seed = 5});
  CHECK(field.family() == SOLIDTEX_FAMILY_LATTICE);
  CHECK(field.channel_count() == 2);
  CHECK(field.channel_name(0) == "albedo.r");
  CHECK(field.channel_name(1) == "rough");
  CHECK(field.color_space() == "srgb");
  CHECK(field.name() == "tiny-lattice");
  CHECK(field.path().empty());
  CHECK(field.seed() == 5);
  CHECK(field.parameter_count() == 164);
  CHECK(field.metadata_json().find("tiny-lattice") != std::string::npos);
  const auto sampler = solidtex::texture::from_memory(tiny_sampler_file());
  CHECK(sampler.family() == SOLIDTEX_FAMILY_SAMPLER);
  CHECK(sampler.channel_count() == 3);
  CHECK(sampler.color_space() == "linear");
  CHECK(sampler.seed() == 0);
  CHECK(sampler.precision() == "full");
}

TEST_CASE("wrapper: the lattice family is as exact in fast precision as in full", "[api]") {
  const auto full = solidtex::texture::from_memory(tiny_lattice_file());
  const auto fast = solidtex::texture::from_memory(tiny_lattice_file(), {.precision = "fast"});
  CHECK(fast.precision() == "fast");
  CHECK(box_of(fast, {-3, 5, 9}, 6) == box_of(full, {-3, 5, 9}, 6));
}

TEST_CASE("wrapper: points at voxel centers are the voxels, bit for bit", "[api]") {
  for (const auto& bytes : {tiny_lattice_file(), tiny_sampler_file()}) {
    const auto texture = solidtex::texture::from_memory(bytes, {.seed = 3});
    const std::array<std::int64_t, 3> origin{-3, 1 << 30, -(1 << 30)};
    const auto box = box_of(texture, origin, 6);
    std::vector<float> points;
    for (int i = 0; i < 216; ++i) {
      for (const int index : {i / 36, i / 6 % 6, i % 6}) points.push_back(float(index) + 0.5f);
    }
    std::vector<float> values(box.size());
    texture.eval_points({double(origin[0]), double(origin[1]), double(origin[2])}, points, values);
    CHECK(values == box);
    const auto [low, high] = std::minmax_element(box.begin(), box.end());
    CHECK(*low < *high);
  }
}

TEST_CASE("wrapper: a moved texture is the same, and its cache has statistics", "[api]") {
  auto first = solidtex::texture::from_memory(tiny_lattice_file(), {.cache_limit_bytes = 1 << 20});
  const auto expected = box_of(first, {0, 0, 0}, 4);
  const solidtex::texture second = std::move(first);
  CHECK(box_of(second, {0, 0, 0}, 4) == expected);
  CHECK(second.statistics().miss_count == 0);
  const std::vector<float> points(30, 1.5f);
  std::vector<float> values(20);
  second.eval_points({0, 0, 0}, points, values);
  second.eval_points({0, 0, 0}, points, values);
  const solidtex_statistics stats = second.statistics();
  CHECK(stats.miss_count == 1);
  CHECK(stats.hit_count == 1);
  CHECK(stats.resident_bytes > 0);
  CHECK(stats.peak_bytes <= 1 << 20);
}

TEST_CASE("wrapper: errors are exceptions with the engine's message", "[api]") {
  const auto texture = solidtex::texture::from_memory(tiny_lattice_file());
  std::vector<float> values(2);
  try {
    texture.eval_points({0, 0, 0}, std::vector<float>{0, NAN, 0}, values);
    FAIL("no exception");
  } catch (const solidtex::error& error) {
    CHECK(error.status() == SOLIDTEX_INVALID_ARGUMENT);
    CHECK(std::string(error.what()).find("point 0: y is nan") != std::string::npos);
  }
  CHECK_THROWS_AS(solidtex::texture("no/such.solidtex"), solidtex::error);
}

TEST_CASE("wrapper: refusals say what was found and what was expected", "[api]") {
  auto texture = solidtex::texture::from_memory(tiny_lattice_file());
  const std::vector<float> one(3), three(9);
  std::vector<float> values(2), none;
  const auto points = [&](const std::vector<float>& at, std::span<float> jacobians = {}) {
    return refusal([&] { texture.eval_points({0, 0, 0}, at, values, jacobians); });
  };
  const auto box = [&](const std::array<std::int64_t, 3>& size, std::span<float> out) {
    return refusal([&] { texture.eval_box({0, 0, 0}, size, out); });
  };
  CHECK(points(std::vector<float>(4)) == "points: found 4 floats, expected three for each point");
  CHECK(points(three) == "values: found 2 floats, expected 3 x 2");
  CHECK(points(one, values) == "jacobians: found 2 floats, expected 1 x 2 x 3");
  CHECK(refusal([&] { texture.eval_filtered({}, one, one, values); }) ==
        "radii: found 3 floats, expected 1");
  CHECK(refusal([&] { texture.eval_footprints({}, one, std::vector<float>(8), values); }) ==
        "axes: found 8 floats, expected 1 x 3 x 3");
  CHECK(box({1, 1, 2}, values) == "values: found 2 floats, expected 1 x 1 x 2 x 2");
  CHECK(box({-1, 1, -2}, values) == "size: found a negative number, expected 0 or more");
  const std::int64_t huge = std::int64_t{1} << 32;  // the product of three is 0 in 64 bits
  CHECK(box({huge, huge, huge}, none) ==
        "values: found 0 floats, expected 4294967296 x 4294967296 x 4294967296 x 2");
  CHECK(refusal([] { solidtex::texture::from_memory({}); }) ==
        "bytes: found none, expected those of a .solidtex file");
  const solidtex::texture taken = std::move(texture);
  CHECK(points(one) == "texture: found one that was moved from, expected an open one");
  CHECK(box({1, 1, 1}, values) == "texture: found one that was moved from, expected an open one");
}

TEST_CASE("wrapper: threads share a texture", "[api][threads]") {
  const auto texture = solidtex::texture::from_memory(tiny_lattice_file());
  std::vector<float> points;
  for (int i = 0; i < 3000; ++i) points.push_back(static_cast<float>(i * 37 % 101) * 0.7f);
  std::vector<float> expected(2000);
  solidtex::texture::from_memory(tiny_lattice_file()).eval_points({0, 0, 0}, points, expected);
  std::vector<std::vector<float>> found(6, std::vector<float>(2000));
  std::vector<std::thread> threads;
  for (auto& values : found) {
    threads.emplace_back([&] { texture.eval_points({0, 0, 0}, points, values); });
  }
  for (std::thread& thread : threads) thread.join();
  for (const auto& values : found) CHECK(values == expected);
}

TEST_CASE("wrapper: a query reports its own progress and is cancelled by it", "[api]") {
  const auto texture = solidtex::texture::from_memory(tiny_sampler_file());
  std::vector<float> values(64 * 64 * 64 * 3), expected(values.size());
  texture.eval_box({}, {64, 64, 64}, expected);
  int calls = 0;
  texture.eval_box({}, {64, 64, 64}, values, [&](double done) {
    CHECK((done >= 0 && done <= 1));
    ++calls;
    return false;
  });
  CHECK(calls > 0);
  CHECK(values == expected);
  try {
    texture.eval_box({}, {64, 64, 64}, values, [](double) { return true; });
    FAIL("no exception");
  } catch (const solidtex::error& error) {
    CHECK(error.status() == SOLIDTEX_CANCELLED);
  }
}

TEST_CASE("wrapper: models are listed by name", "[api]") {
  setenv("SOLIDTEX_MODEL_PATH", SOLIDTEX_SOURCE "/models", 1);
  const std::vector<std::string> names = solidtex::models();
  CHECK(std::is_sorted(names.begin(), names.end()));
  CHECK(std::count(names.begin(), names.end(), "granite-grey") == 1);
  for (const std::string& name : names) CHECK_NOTHROW(solidtex::texture(name));
  setenv("SOLIDTEX_MODEL_PATH", "/none", 1);
  for (const std::string& name : solidtex::models()) CHECK(!name.empty());
  unsetenv("SOLIDTEX_MODEL_PATH");
}
