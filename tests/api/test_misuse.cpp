// Misuse: every wrong call returns a status and a message that names the fault.
#include <solidtex/solidtex.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <string>
#include <thread>

#include "catch.hpp"
#include "tiny_model.h"

namespace {

bool error_has(const std::string& part) {
  const std::string message = solidtex_error_message();
  INFO(message);
  return message.find(part) != std::string::npos;
}

struct Opened {
  solidtex_texture* texture = solidtex_new();
  explicit Opened(const std::vector<std::byte>& bytes) {
    REQUIRE(solidtex_open_memory(texture, bytes.data(), bytes.size()) == SOLIDTEX_OK);
    solidtex_clear_error();
  }
  ~Opened() { solidtex_release(texture); }
};

// Not open yet.
struct Closed {
  solidtex_texture* texture = solidtex_new();
  ~Closed() { solidtex_release(texture); }
};

}  // namespace

TEST_CASE("misuse: null arguments are named", "[misuse]") {
  const Opened opened(tiny_lattice_file());
  solidtex_texture* texture = opened.texture;
  float values[8] = {};
  const float point[3] = {};
  const int64_t origin[3] = {}, size[3] = {1, 1, 1};
  solidtex_statistics statistics = {};
  statistics.struct_size = sizeof statistics;
  const auto refused = [](solidtex_status status, const char* part) {
    const bool named = error_has(part);
    solidtex_clear_error();
    return status == SOLIDTEX_INVALID_ARGUMENT && named;
  };
  const Closed closed;
  uint64_t number = 1;
  const char* text = "";
  CHECK(refused(solidtex_open(closed.texture, nullptr), "model is null"));
  CHECK(refused(solidtex_open(nullptr, "granite-grey"), "texture is null"));
  CHECK(refused(solidtex_open_memory(closed.texture, nullptr, 8), "bytes is null"));
  CHECK(refused(solidtex_open_memory(nullptr, "12345678", 8), "texture is null"));
  CHECK(refused(solidtex_set_integer(nullptr, "seed", 1), "texture is null"));
  CHECK(refused(solidtex_set_integer(closed.texture, nullptr, 1), "name is null"));
  CHECK(refused(solidtex_set_string(closed.texture, "precision", nullptr), "value is null"));
  CHECK(refused(solidtex_get_integer(nullptr, "seed", &number), "texture is null"));
  CHECK(number == 0);
  CHECK(refused(solidtex_get_integer(texture, "seed", nullptr), "value is null"));
  CHECK(refused(solidtex_get_string(texture, nullptr, &text), "name is null"));
  CHECK(text == nullptr);
  CHECK(refused(solidtex_set_error_callback(nullptr, nullptr, nullptr), "texture is null"));
  CHECK(refused(solidtex_set_progress_callback(nullptr, nullptr, nullptr), "texture is null"));
  CHECK(refused(solidtex_eval_box(closed.texture, origin, size, values), "texture is not open"));
  CHECK(refused(solidtex_get_statistics(closed.texture, &statistics), "texture is not open"));
  CHECK((solidtex_name(closed.texture) == nullptr && error_has("texture is not open")));
  solidtex_clear_error();
  CHECK(refused(solidtex_eval_points(nullptr, nullptr, point, 1, values, nullptr),
                "texture is null"));
  CHECK(refused(solidtex_eval_points(texture, nullptr, nullptr, 1, values, nullptr),
                "points is null"));
  CHECK(refused(solidtex_eval_points(texture, nullptr, point, 1, nullptr, nullptr),
                "values is null"));
  const float axes[9] = {1, 0, 0, 0, NAN, 0, 0, 0, 1};
  const auto footprints = [&](solidtex_texture* on, const float* at, const float* of, float* to) {
    return solidtex_eval_footprints(on, nullptr, at, of, 1, to, nullptr);
  };
  CHECK(refused(footprints(nullptr, point, axes, values), "texture is null"));
  CHECK(refused(footprints(texture, nullptr, axes, values), "points is null"));
  CHECK(refused(footprints(texture, point, nullptr, values), "axes is null"));
  CHECK(refused(footprints(texture, point, axes, nullptr), "values is null"));
  CHECK(refused(footprints(texture, point, axes, values), "axis 1 of point 0: y is no number"));
  CHECK(solidtex_eval_footprints(texture, nullptr, nullptr, nullptr, 0, nullptr, nullptr) ==
        SOLIDTEX_OK);
  CHECK(refused(solidtex_eval_box(nullptr, origin, size, values), "texture is null"));
  CHECK(refused(solidtex_eval_box(texture, nullptr, size, values), "origin is null"));
  CHECK(refused(solidtex_eval_box(texture, origin, nullptr, values), "size is null"));
  CHECK(refused(solidtex_eval_box(texture, origin, size, nullptr), "values is null"));
  CHECK(refused(solidtex_get_statistics(nullptr, &statistics), "texture is null"));
  CHECK(refused(solidtex_get_statistics(texture, nullptr), "statistics is null"));
  solidtex_retain(nullptr);
  solidtex_release(nullptr);
  CHECK(solidtex_error_status() == SOLIDTEX_OK);
}

TEST_CASE("misuse: facts of a null texture are empty and leave an error", "[misuse]") {
  const auto failed = [] {
    const bool result = solidtex_error_status() == SOLIDTEX_INVALID_ARGUMENT;
    solidtex_clear_error();
    return result;
  };
  CHECK((solidtex_channel_count(nullptr) == 0 && failed()));
  CHECK((solidtex_channel_name(nullptr, 0) == nullptr && failed()));
  CHECK((solidtex_color_space(nullptr) == nullptr && failed()));
  CHECK((solidtex_name(nullptr) == nullptr && failed()));
  CHECK((solidtex_metadata_json(nullptr) == nullptr && failed()));
  CHECK((solidtex_parameter_count(nullptr) == 0 && failed()));
  CHECK((solidtex_path(nullptr) == nullptr && failed()));
  CHECK((solidtex_get_family(nullptr) == SOLIDTEX_FAMILY_LATTICE && failed()));
  const Opened opened(tiny_lattice_file());
  CHECK(solidtex_channel_name(opened.texture, 2) == nullptr);
  CHECK(error_has("channel is 2, expected less than 2"));
  solidtex_clear_error();
}

TEST_CASE("misuse: struct sizes of no version", "[misuse]") {
  const Opened opened(tiny_lattice_file());
  solidtex_statistics statistics = {};
  for (const std::size_t size : {0, 7, 8, 73, 4096}) {
    statistics.struct_size = size;
    CHECK(solidtex_get_statistics(opened.texture, &statistics) == SOLIDTEX_INVALID_ARGUMENT);
    CHECK(
        error_has("solidtex_statistics.struct_size is " + std::to_string(size) + ", expected 88"));
    solidtex_clear_error();
  }
}

TEST_CASE("misuse: structs of older and newer headers", "[misuse]") {
  const Opened opened(tiny_lattice_file());
  const float point[3] = {};
  float values[2] = {};
  REQUIRE(solidtex_eval_points(opened.texture, nullptr, point, 1, values, nullptr) == SOLIDTEX_OK);

  // An older struct ends after voxel_count: the library does not write beyond it.
  solidtex_statistics old = {};
  old.struct_size = offsetof(solidtex_statistics, hit_count);
  old.hit_count = 77;
  CHECK(solidtex_get_statistics(opened.texture, &old) == SOLIDTEX_OK);
  CHECK(old.struct_size == offsetof(solidtex_statistics, hit_count));
  CHECK(old.point_count == 1);
  CHECK(old.hit_count == 77);

  struct Newer {
    solidtex_statistics known = {};
    uint64_t unknown = 0;
  } newer;
  newer.known.struct_size = sizeof newer;
  CHECK(solidtex_get_statistics(opened.texture, &newer.known) == SOLIDTEX_OK);
  CHECK(newer.known.struct_size == sizeof newer);
  CHECK(newer.known.point_count == 1);
  newer.unknown = 1;
  CHECK(solidtex_get_statistics(opened.texture, &newer.known) == SOLIDTEX_INVALID_ARGUMENT);
  CHECK(error_has("solidtex_statistics.struct_size is 96, expected 88: this library, version"));
  solidtex_clear_error();

  // A host that was compiled before the scratch memory was counted.
  solidtex_statistics before_scratch = {};
  before_scratch.struct_size = offsetof(solidtex_statistics, scratch_bytes);
  before_scratch.scratch_bytes = 77;
  CHECK(solidtex_get_statistics(opened.texture, &before_scratch) == SOLIDTEX_OK);
  CHECK(before_scratch.point_count == 1);
  CHECK(before_scratch.scratch_bytes == 77);

  // A struct that ends before `axes` has no axes.
  const float radius = 2;
  solidtex_footprints footprints = {offsetof(solidtex_footprints, axes), &radius,
                                    reinterpret_cast<const float*>(8)};
  CHECK(solidtex_eval(opened.texture, nullptr, point, &footprints, 1, values, nullptr) ==
        SOLIDTEX_OK);
}

TEST_CASE("misuse: footprints need radii or axes, not both", "[misuse]") {
  const Opened opened(tiny_sampler_file());
  const float point[3] = {}, axes[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  float values[3] = {7, 7, 7};
  solidtex_footprints footprints = {sizeof footprints, nullptr, nullptr};
  const auto eval = [&] {
    return solidtex_eval(opened.texture, nullptr, point, &footprints, 1, values, nullptr);
  };
  CHECK(eval() == SOLIDTEX_INVALID_ARGUMENT);
  CHECK(error_has("radii is null and axes is null, expected one of them"));
  solidtex_clear_error();
  footprints = {sizeof footprints, axes, axes};
  CHECK(eval() == SOLIDTEX_INVALID_ARGUMENT);
  CHECK(error_has("radii and axes are set, expected one of them"));
  solidtex_clear_error();
  CHECK(values[0] == 7);
  footprints.radii = nullptr;
  CHECK(eval() == SOLIDTEX_OK);
}

TEST_CASE("misuse: the entry for all footprints gives the bits of the older functions",
          "[misuse]") {
  for (const auto& bytes : {tiny_lattice_file(), tiny_sampler_file()}) {
    const Opened opened(bytes);
    const std::size_t size = 4 * solidtex_channel_count(opened.texture);
    const float points[12] = {0.25f, 1, -3, 9.5f, 2, 4, 30, -8, 0.75f, 5, 5, 5};
    const float radii[4] = {0, 0.5f, 3, INFINITY};
    float axes[36] = {};
    for (int p = 0; p < 4; ++p)
      for (int axis = 0; axis < 3; ++axis) axes[9 * p + 4 * axis] = radii[p];
    const auto values_of = [&](const solidtex_footprints* footprints) {
      std::vector<float> values(size);
      REQUIRE(solidtex_eval(opened.texture, nullptr, points, footprints, 4, values.data(),
                            nullptr) == SOLIDTEX_OK);
      return values;
    };
    const solidtex_footprints cubes = {sizeof cubes, radii, nullptr};
    const solidtex_footprints equal_axes = {sizeof equal_axes, nullptr, axes};
    CHECK(values_of(&cubes) == values_of(&equal_axes));
    std::vector<float> plain(size), filtered(size);
    REQUIRE(solidtex_eval_points(opened.texture, nullptr, points, 4, plain.data(), nullptr) ==
            SOLIDTEX_OK);
    REQUIRE(solidtex_eval_filtered(opened.texture, nullptr, points, radii, 4, filtered.data(),
                                   nullptr) == SOLIDTEX_OK);
    CHECK(values_of(nullptr) == plain);
    CHECK(values_of(&cubes) == filtered);
    CHECK(plain != filtered);
  }
}

TEST_CASE("misuse: parameters that are unknown, out of range or set too late", "[misuse]") {
  const Closed closed;
  const auto refused = [](solidtex_status status, const char* part) {
    const bool named = error_has(part);
    solidtex_clear_error();
    return status == SOLIDTEX_INVALID_ARGUMENT && named;
  };
  solidtex_texture* texture = closed.texture;
  CHECK(refused(solidtex_set_integer(texture, "sed", 1),
                "no parameter \"sed\" of this type; there are the integers cache_limit_bytes, "
                "period, seed, threads and the string precision"));
  CHECK(refused(solidtex_set_integer(texture, "precision", 1), "no parameter \"precision\""));
  CHECK(refused(solidtex_set_string(texture, "seed", "1"), "no parameter \"seed\""));
  CHECK(refused(solidtex_set_string(texture, "precision", "half"),
                "parameter \"precision\" is \"half\", expected \"full\" or \"fast\""));
  CHECK(refused(solidtex_set_integer(texture, "threads", 1025),
                "parameter \"threads\" is 1025, expected 0 to 1024"));
  uint64_t number = 1;
  const char* text = nullptr;
  CHECK(refused(solidtex_get_integer(texture, "depth", &number), "no parameter \"depth\""));
  CHECK(refused(solidtex_get_string(texture, "", &text), "no parameter \"\""));

  const Opened opened(tiny_sampler_file());
  CHECK(refused(solidtex_set_integer(opened.texture, "seed", 1), "texture is open already"));
  CHECK(refused(solidtex_set_string(opened.texture, "precision", "fast"), "open already"));
  CHECK(refused(solidtex_set_error_callback(opened.texture, nullptr, nullptr), "open already"));
  CHECK(refused(solidtex_set_progress_callback(opened.texture, nullptr, nullptr), "open already"));
  CHECK(refused(solidtex_open(opened.texture, "granite-grey"), "open already"));
}

TEST_CASE("misuse: empty queries succeed and write nothing", "[misuse]") {
  const Opened opened(tiny_sampler_file());
  CHECK(solidtex_eval_points(opened.texture, nullptr, nullptr, 0, nullptr, nullptr) == SOLIDTEX_OK);
  const int64_t origin[3] = {1, 2, 3}, flat[3] = {4, 0, 4};
  CHECK(solidtex_eval_box(opened.texture, origin, flat, nullptr) == SOLIDTEX_OK);
}

TEST_CASE("misuse: sizes and coordinates out of range", "[misuse]") {
  for (const auto& bytes : {tiny_lattice_file(), tiny_sampler_file()}) {
    const Opened opened(bytes);
    float values[3] = {7, 7, 7};
    const auto refused = [&](solidtex_status status, const char* part) {
      const bool named = error_has(part);
      solidtex_clear_error();
      return status == SOLIDTEX_INVALID_ARGUMENT && named && values[0] == 7;
    };
    const auto box = [&](std::array<int64_t, 3> origin, std::array<int64_t, 3> size) {
      return solidtex_eval_box(opened.texture, origin.data(), size.data(), values);
    };
    const auto point = [&](float x, float y, float z, double far = 0) {
      const float at[3] = {x, y, z};
      const double origin[3] = {0, 0, far};
      return solidtex_eval_points(opened.texture, origin, at, 1, values, nullptr);
    };
    CHECK(refused(box({0, 0, 0}, {-1, 1, 1}), "size along x is -1"));
    CHECK(refused(box({0, 0, 0}, {INT64_MIN, 1, 1}), "size along x is -9223372036854775808"));
    CHECK(refused(box({0, INT64_MAX, 0}, {1, 1, 1}), "along y has origin 9223372036854775807"));
    CHECK(refused(box({0, 0, 0}, {1, 1, INT64_MAX}), "size 9223372036854775807"));
    CHECK(refused(box({0, 0, 0}, {1 << 30, 1 << 30, 1 << 30}), "more than memory can hold"));
    CHECK(refused(point(NAN, 0, 0), "point 0: x is nan"));
    CHECK(refused(point(0, -INFINITY, 0), "point 0: y is -inf"));
    CHECK(refused(point(0, 0, 3e9f), "point 0: z is 3000000000"));
    CHECK(refused(point(0, 0, 5, 1e300), "z is 1.0000000000000001e+300"));
    const float one[3] = {};
    CHECK(refused(solidtex_eval_points(opened.texture, nullptr, one, SIZE_MAX, values, nullptr),
                  "count is 18446744073709551615"));
    CHECK(refused(
        solidtex_eval_points(opened.texture, nullptr, one, SIZE_MAX / 12 + 1, values, nullptr),
        "more points than memory can hold"));
  }
}

TEST_CASE("misuse: random and damaged bytes are no model", "[misuse]") {
  const Closed closed;
  std::mt19937 random(1);
  for (int attempt = 0; attempt < 300; ++attempt) {
    std::vector<std::byte> bytes(random() % 600);
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
    const char empty = 0;
    const void* start = bytes.empty() ? static_cast<const void*>(&empty) : bytes.data();
    REQUIRE(solidtex_open_memory(closed.texture, start, bytes.size()) == SOLIDTEX_INVALID_MODEL);
    REQUIRE(error_has("model in memory"));
    solidtex_clear_error();
  }
  const auto valid = tiny_lattice_file();
  for (std::size_t size = 0; size < valid.size(); size += 5) {
    REQUIRE(solidtex_open_memory(closed.texture, valid.data(), size) == SOLIDTEX_INVALID_MODEL);
    solidtex_clear_error();
  }
  // A texture that failed to open can be opened again.
  CHECK(solidtex_open_memory(closed.texture, valid.data(), valid.size()) == SOLIDTEX_OK);
  CHECK(std::string(solidtex_name(closed.texture)) == "tiny-lattice");
}

TEST_CASE("misuse: the first error of a thread is kept, and is its own", "[misuse]") {
  const Closed closed;
  CHECK(solidtex_open(closed.texture, nullptr) == SOLIDTEX_INVALID_ARGUMENT);
  CHECK(solidtex_open(closed.texture, "no/such/file.solidtex") == SOLIDTEX_IO_ERROR);
  CHECK(error_has("model is null"));
  CHECK(solidtex_error_status() == SOLIDTEX_INVALID_ARGUMENT);
  std::string elsewhere = "unset";
  std::thread([&] { elsewhere = solidtex_error_message(); }).join();
  CHECK(elsewhere.empty());
  solidtex_clear_error();
  CHECK(std::string(solidtex_error_message()).empty());
  CHECK(solidtex_open(closed.texture, "no/such/file.solidtex") == SOLIDTEX_IO_ERROR);
  CHECK(error_has("no/such/file.solidtex"));
  solidtex_clear_error();
}

TEST_CASE("lookup: a bare name is found, an unknown one lists the known ones", "[lookup]") {
  namespace fs = std::filesystem;
  const fs::path folder =
      fs::temp_directory_path() / ("solidtex-lookup-" + std::to_string(getpid()));
  fs::create_directories(folder / "b");
  const auto bytes = tiny_lattice_file();
  std::ofstream(folder / "b" / "pebbles.solidtex", std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  setenv("SOLIDTEX_MODEL_PATH", ((folder / "a").string() + ":" + (folder / "b").string()).c_str(),
         1);

  const Closed found, other;
  REQUIRE(solidtex_open(found.texture, "pebbles") == SOLIDTEX_OK);
  CHECK(solidtex_path(found.texture) == (folder / "b" / "pebbles.solidtex").string());
  CHECK(std::string(solidtex_name(found.texture)) == "tiny-lattice");

  CHECK(solidtex_open(other.texture, "marzipan") == SOLIDTEX_IO_ERROR);
  CHECK(error_has("\"marzipan\""));
  CHECK(error_has("pebbles"));
  CHECK(error_has((folder / "a").string()));
  CHECK(error_has("share/solidtex/models"));
  solidtex_clear_error();
  CHECK(solidtex_open(other.texture, "") == SOLIDTEX_INVALID_ARGUMENT);
  solidtex_clear_error();
  unsetenv("SOLIDTEX_MODEL_PATH");
  fs::remove_all(folder);
}
