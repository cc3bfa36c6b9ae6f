#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cfenv>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <thread>
#include <vector>

#include "catch.hpp"
#include "texture_queries.h"

using namespace texture_queries;

namespace {

constexpr std::int64_t kFar = std::int64_t{1} << 30;

// Returns the offsets of a box's voxel centers from its corner, in the order of its voxels.
std::vector<float> centers(const Index3& size) {
  std::vector<float> points;
  for (std::int64_t x = 0; x < size[0]; ++x) {
    for (std::int64_t y = 0; y < size[1]; ++y) {
      for (std::int64_t z = 0; z < size[2]; ++z) {
        for (const std::int64_t i : {x, y, z}) points.push_back(static_cast<float>(i) + 0.5f);
      }
    }
  }
  return points;
}

// Assembles a box from parts of at most `step` voxels.
Values box_in_parts(const Texture& texture, const Index3& origin, const Index3& size,
                    const Index3& step) {
  const std::size_t channels = texture.model().channels.size();
  Values whole(static_cast<std::size_t>(size[0] * size[1] * size[2]) * channels);
  Index3 at{};
  for (at[0] = 0; at[0] < size[0]; at[0] += step[0]) {
    for (at[1] = 0; at[1] < size[1]; at[1] += step[1]) {
      for (at[2] = 0; at[2] < size[2]; at[2] += step[2]) {
        Index3 part_origin, part;
        for (int axis = 0; axis < 3; ++axis) {
          part_origin[axis] = origin[axis] + at[axis];
          part[axis] = std::min(step[axis], size[axis] - at[axis]);
        }
        const Values values = box_of(texture, part_origin, part);
        const float* row = values.data();
        for (std::int64_t x = 0; x < part[0]; ++x) {
          for (std::int64_t y = 0; y < part[1];
               ++y, row += static_cast<std::size_t>(part[2]) * channels) {
            const auto voxel = ((at[0] + x) * size[1] + at[1] + y) * size[2] + at[2];
            std::copy_n(row, static_cast<std::size_t>(part[2]) * channels,
                        &whole[static_cast<std::size_t>(voxel) * channels]);
          }
        }
      }
    }
  }
  return whole;
}

bool varied(const Values& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return *high - *low > 0.05f && std::isfinite(*low) && std::isfinite(*high);
}

// Four threads, also on machines with fewer cores.
struct FourThreads {
  tbb::global_control control{tbb::global_control::max_allowed_parallelism, 4};
};

}  // namespace

TEST_CASE("texture: a point at a voxel center is the voxel, bit for bit", "[texture]") {
  for (const Model& model : models()) {
    const Texture texture(model, kSeed, kLargeCache);
    const Index3 size{9, 18, 35};
    for (const Index3& origin : {Index3{0, 0, 0}, Index3{-20, -7, 100}, Index3{kFar, -kFar, kFar},
                                 Index3{-kFar - 9, 3, kFar - 40}}) {
      const Values voxels = box_of(texture, origin, size);
      const std::array<double, 3> corner{double(origin[0]), double(origin[1]), double(origin[2])};
      CHECK(same(voxels, points_of(texture, corner, centers(size))));
      CHECK(varied(voxels));
    }
  }
}

TEST_CASE("texture: points of a lattice are cubic convolutions of voxels", "[texture]") {
  // Keys 1981, equation 6 with a = -3/4, by the distance from a voxel center.
  const auto weight = [](double s) {
    const double a = -0.75;
    s = std::abs(s);
    if (s < 1) return (a + 2) * s * s * s - (a + 3) * s * s + 1;
    return s < 2 ? a * (s * s * s - 5 * s * s + 8 * s - 4) : 0;
  };
  const std::string folder = std::string(SOLIDTEX_MODELS) + "/";
  for (const Model& model : {tiny_lattice(), read_model(folder + "granite-grey.solidtex"),
                             read_model(folder + "paint-rusted.solidtex")}) {  // 2, 3, 5 channels
    const std::size_t channels = model.channels.size();
    const Texture texture(model, kSeed, kLargeCache);
    const auto points = random_points(60, 40);
    const Values values = points_of(texture, {0, 0, 0}, points);
    for (std::size_t p = 0; p < points.size() / 3; ++p) {
      Index3 base;
      double t[3];
      for (int axis = 0; axis < 3; ++axis) {
        const double u = static_cast<double>(points[3 * p + axis]) - 0.5;
        base[axis] = static_cast<std::int64_t>(std::floor(u)) - 1;
        t[axis] = u - static_cast<double>(base[axis]);
      }
      const Values voxels = box_of(texture, base, {4, 4, 4});  // [x][y][z][channel]
      for (std::size_t c = 0; c < channels; ++c) {
        double sum = 0;
        for (std::size_t i = 0; i < 64; ++i)
          sum += weight(t[0] - double(i / 16)) * weight(t[1] - double(i / 4 % 4)) *
                 weight(t[2] - double(i % 4)) * static_cast<double>(voxels[channels * i + c]);
        REQUIRE(values[channels * p + c] == Approx(sum).margin(2e-6));
      }
    }
  }
}

TEST_CASE("texture: any partition of a box has the same bits", "[texture]") {
  for (const Model& model : models()) {
    const Texture texture(model, kSeed, kLargeCache);
    const Index3 origin{-37, 5, -70}, size{67, 21, 81};
    const Values whole = box_of(texture, origin, size);
    for (const Index3& step : {Index3{67, 21, 2}, Index3{16, 16, 16}, Index3{5, 21, 7},
                               Index3{64, 3, 64}, Index3{33, 20, 80}}) {
      CHECK(same(whole, box_in_parts(texture, origin, size, step)));
    }
    CHECK(varied(whole));
  }
}

TEST_CASE("texture: any number of threads gives the same bits", "[texture][threads]") {
  const FourThreads four;
  for (const Model& model : models()) {
    const auto points = random_points(3000, 25);
    Values box, values;
    for (const int threads : {1, 2, 4}) {
      const Texture texture(model, kSeed, kLargeCache);
      tbb::task_arena arena(threads);
      arena.execute([&] {
        const Values box_now = box_of(texture, {-9, 130, 7}, {65, 37, 20});
        const Values values_now = points_of(texture, {0.25, -3, 1e6}, points);
        if (threads == 1) {
          box = box_now;
          values = values_now;
        }
        CHECK(same(box, box_now));
        CHECK(same(values, values_now));
      });
    }
    CHECK(varied(values));
  }
}

TEST_CASE("texture: fast precision has the same bits in any threads, points and boxes",
          "[texture][threads]") {
  const FourThreads four;
  const Texture texture(read_model(std::string(SOLIDTEX_MODELS) + "/stone-grey.solidtex"), kSeed,
                        kLargeCache, Precision::fast);
  const Index3 origin{-5, 7, 1 << 20}, size{19, 22, 33};
  Values voxels;
  tbb::task_arena(1).execute([&] { voxels = box_of(texture, origin, size); });
  tbb::task_arena(4).execute([&] {
    CHECK(same(voxels, box_of(texture, origin, size)));
    const std::array<double, 3> corner{double(origin[0]), double(origin[1]), double(origin[2])};
    CHECK(same(voxels, points_of(texture, corner, centers(size))));
  });
  CHECK(varied(voxels));
}

TEST_CASE("texture: order, batches and the cache limit do not change a point", "[texture]") {
  for (const Model& model : models()) {
    const Texture texture(model, kSeed, kLargeCache);
    const std::size_t channels = model.channels.size();
    const auto points = random_points(700, 30);
    const Values values = points_of(texture, {0, 0, 0}, points);

    std::vector<std::size_t> order(700);
    std::iota(order.begin(), order.end(), 0u);
    std::shuffle(order.begin(), order.end(), std::mt19937(3));
    for (const std::uint64_t limit : {std::uint64_t{0}, std::uint64_t{100000}, kLargeCache}) {
      const Texture other(model, kSeed, limit);
      std::vector<float> shuffled;
      Values expected;
      for (const std::size_t point : order) {
        shuffled.insert(shuffled.end(), &points[3 * point], &points[3 * point] + 3);
        expected.insert(expected.end(), &values[channels * point],
                        &values[channels * point] + channels);
      }
      CHECK(same(expected, points_of(other, {0, 0, 0}, shuffled)));
      CHECK(other.cache_stats().peak_bytes <= limit);
    }
    for (std::size_t point = 0; point < 50; ++point) {
      const Values one =
          points_of(texture, {0, 0, 0}, {&points[3 * point], &points[3 * point] + 3});
      CHECK(std::equal(one.begin(), one.end(), &values[channels * point]));
    }
  }
}

TEST_CASE("texture: only the sum of origin and point matters", "[texture]") {
  for (const Model& model : models()) {
    const Texture texture(model, kSeed, kLargeCache);
    for (const double far : {0.0, 1024.0, static_cast<double>(kFar), -static_cast<double>(kFar)}) {
      // Multiples of 2^-10 up to 2^13: exact in float, and in double after adding 2^30.
      std::vector<float> here, there;
      std::mt19937 random(5);
      for (int i = 0; i < 300; ++i) {
        const float value = static_cast<float>(random() % 8192) / 1024.0f;
        here.push_back(value);
        there.push_back(value - 3000.5f);
      }
      const Values values = points_of(texture, {far, far, far}, here);
      CHECK(same(values, points_of(texture, {far + 3000.5, far + 3000.5, far + 3000.5}, there)));
      CHECK(varied(values));
    }
  }
}

TEST_CASE("texture: the seed changes everything, two textures with one seed nothing", "[texture]") {
  for (const Model& model : models()) {
    const Values a = box_of(Texture(model, 1, 0), {0, 0, 0}, {8, 8, 8});
    CHECK(same(a, box_of(Texture(model, 1, kLargeCache), {0, 0, 0}, {8, 8, 8})));
    CHECK(!same(a, box_of(Texture(model, 2, 0), {0, 0, 0}, {8, 8, 8})));
  }
}

TEST_CASE("texture: points and footprints of a periodic lattice repeat", "[texture]") {
  const Model model = tiny_lattice();
  const Texture texture(model, kSeed, kLargeCache, Precision::full, 0, 16);
  const auto points = random_points(200, 30);
  const Values values = points_of(texture, {0, 0, 0}, points);
  CHECK(varied(values));
  CHECK(same(values, points_of(texture, {16, -32, 160}, points)));
  CHECK(!same(values, points_of(texture, {15, -32, 160}, points)));
}

TEST_CASE("texture: a sampler refuses a period", "[texture]") {
  const Model model = tiny_sampler();
  CHECK(message_of([&] {
          Texture(model, kSeed, 0, Precision::full, 0, 64);
        }).starts_with("parameter \"period\" is 64, expected 0 for a model of the sampler"));
}

TEST_CASE("texture: the host's rounding mode does not matter, and is restored", "[texture]") {
  for (const Model& model : models()) {
    const Texture texture(model, kSeed, 0);
    const auto points = random_points(2000, 30);
    const Values box = box_of(texture, {-5, 0, 0}, {66, 33, 17});
    const Values values = points_of(texture, {0, 0, 0}, points);
    std::fesetround(FE_UPWARD);
    const Values box_up = box_of(texture, {-5, 0, 0}, {66, 33, 17});
    const Values values_up = points_of(texture, {0, 0, 0}, points);
    const int mode = std::fegetround();
    std::fesetround(FE_TONEAREST);
    CHECK(mode == FE_UPWARD);
    CHECK(same(box, box_up));
    CHECK(same(values, values_up));
  }
}

// For ThreadSanitizer: it cannot see into Debian's oneTBB and reports the hand-over of a task to a
// worker as a race. So every thread has an arena of its own here.
TEST_CASE("texture: threads share one texture and compute each brick once", "[texture][tsan]") {
  const auto points = random_points(4000, 30);
  for (const std::uint64_t limit : {std::uint64_t{300000}, kLargeCache}) {
    Values expected;
    std::uint64_t bricks = 0;
    tbb::task_arena(1).execute([&] {
      const Texture alone(tiny_lattice(), kSeed, kLargeCache);
      expected = points_of(alone, {0, 0, 0}, points);
      bricks = alone.cache_stats().miss_count;
    });
    const Texture texture(tiny_lattice(), kSeed, limit);
    std::atomic<int> wrong = 0;
    std::vector<std::thread> threads;
    for (int i = 0; i < 6; ++i) {
      threads.emplace_back([&] {
        tbb::task_arena(1).execute([&] {
          wrong += !same(points_of(texture, {0, 0, 0}, points), expected);
        });
      });
    }
    for (std::thread& thread : threads) thread.join();
    CHECK(wrong == 0);
    if (limit == kLargeCache) CHECK(texture.cache_stats().miss_count == bricks);
    CHECK(texture.cache_stats().peak_bytes <= limit);
  }
}

TEST_CASE("texture: queries nest in the host's own parallel loops", "[texture][threads]") {
  const FourThreads four;
  for (const std::uint64_t limit : {std::uint64_t{0}, std::uint64_t{100000}, kLargeCache}) {
    const Texture texture(tiny_lattice(), kSeed, limit);
    const auto points = random_points(300, 15);
    const Values expected = points_of(texture, {0, 0, 0}, points);
    std::atomic<int> wrong = 0;
    std::atomic<int> reentered = 0;
    thread_local int depth = 0;
    tbb::task_arena arena(4);
    arena.execute([&] {
      tbb::parallel_for(0, 16, [&](int) {
        if (depth++ > 0) ++reentered;
        wrong += !same(points_of(texture, {0, 0, 0}, points), expected);
        --depth;
      });
    });
    CHECK(wrong == 0);
    CHECK(reentered == 0);  // no host task runs inside another one's query
  }
}

TEST_CASE("texture: a bad point is named and nothing is written", "[texture]") {
  for (const Model& model : models()) {
    const Texture texture(model, kSeed, 0);
    const std::array<double, 3> origin{0, 0, 0};
    const auto attempt = [&](float bad, std::size_t at) {
      auto points = random_points(2000, 10);
      points[at] = bad;
      points[5999] = std::numeric_limits<float>::infinity();
      Values values(2000 * model.channels.size(), 42.0f);
      const std::string message =
          message_of([&] { texture.eval(origin.data(), points.data(), {}, 2000, values.data()); });
      CHECK(std::count(values.begin(), values.end(), 42.0f) == std::ptrdiff_t(values.size()));
      return message;
    };
    CHECK(contains(attempt(std::nanf(""), 3 * 17 + 1), "point 17: y is nan"));
    CHECK(contains(attempt(-std::numeric_limits<float>::infinity(), 3), "point 1: x is -inf"));
    CHECK(contains(attempt(2e9f, 3 * 1500 + 2), "point 1500: z is 2000000000"));
    const std::array<double, 3> nowhere{0, 0, std::nan("")};
    const float point[3] = {1, 2, 3};
    Values values(3);
    CHECK(contains(message_of([&] { texture.eval(nowhere.data(), point, {}, 1, values.data()); }),
                   "point 0: z is nan"));
  }
}

TEST_CASE("texture: a bad box is named", "[texture]") {
  const Texture texture(tiny_lattice(), kSeed, 0);
  constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
  constexpr std::int64_t kMin = std::numeric_limits<std::int64_t>::min();
  const auto attempt = [&](const Index3& origin, const Index3& size) {
    float untouched = 42.0f;
    const std::string message =
        message_of([&] { texture.eval_box(origin.data(), size.data(), &untouched); });
    CHECK(untouched == 42.0f);
    return message;
  };
  CHECK(contains(attempt({0, 0, 0}, {4, -1, 4}), "size along y is -1"));
  CHECK(contains(attempt({0, 0, 2 * kFar}, {1, 1, 1}), "along z has origin 2147483648"));
  CHECK(contains(attempt({kMin, 0, 0}, {1, 1, 1}), "along x has origin -9223372036854775808"));
  CHECK(contains(attempt({5, 0, 0}, {kMax, 1, 1}), "size 9223372036854775807"));
  CHECK(contains(attempt({kMax, 0, 0}, {kMax, 1, 1}), "along x has origin 9223372036854775807"));
  CHECK(contains(attempt({0, 0, 0}, {kFar, kFar, kFar}), "more than memory can hold"));
  CHECK(attempt({0, 0, 0}, {0, kFar, kFar}) == "no error");
}
