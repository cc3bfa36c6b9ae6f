// solidtex.h's texture spaces as a host uses and misuses them.
#include <array>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <solidtex/solidtex.hpp>
#include <thread>
#include <vector>

#include "catch.hpp"
#include "tiny_space.h"

namespace {

using Values = std::vector<float>;

Values voxels(const solidtex::texture& texture) {
  Values values(3 * 4 * 4 * 4);
  texture.eval_box({-2, 0, 5}, {4, 4, 4}, values);
  return values;
}

std::string message_of(solidtex_status status) {
  CHECK(status != SOLIDTEX_OK);
  CHECK(solidtex_error_status() == status);
  std::string message = solidtex_error_message();
  solidtex_clear_error();
  return message;
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("A space tells its facts") {
  const TemporaryFolder folder;
  write_tiny_space(folder.file("tiny.solidtex-space"));
  const solidtex::space space(folder.file("tiny.solidtex-space"));
  CHECK(space.name() == "tiny");
  CHECK(space.path() == folder.file("tiny.solidtex-space"));
  CHECK(space.sha256() == solidtex::file_sha256(space.path()));
  CHECK(space.family() == SOLIDTEX_FAMILY_SAMPLER);
  CHECK(space.code_size() == 2);
  CHECK(space.has_colors());
  CHECK(space.patch_size() == 16);
  CHECK(space.resolution() == 32);
  CHECK(space.photograph_count() == 2);
  CHECK(space.photograph_name(1) == "second");
  CHECK(contains(space.metadata_json(), "\"photographs\""));
  CHECK(space.photograph(0).code != space.photograph(1).code);
}

TEST_CASE("SHA-256 has the published values") {
  const TemporaryFolder folder;
  const auto digest = [&](const std::string& content) {
    std::ofstream(folder.file("f"), std::ios::binary) << content;
    return solidtex::file_sha256(folder.file("f"));
  };
  CHECK(digest("") == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  CHECK(digest("abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  CHECK(digest(std::string(1000000, 'a')) ==
        "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
  CHECK_THROWS_AS(solidtex::file_sha256(folder.file("none")), solidtex::error);
}

TEST_CASE("Threads that write one model file leave it whole, and nothing else") {
  const TemporaryFolder folder;
  write_tiny_space(folder.file("tiny.solidtex-space"));
  const solidtex::space space(folder.file("tiny.solidtex-space"));
  namespace fs = std::filesystem;
  const std::string path = folder.file("models/m.solidtex");
  fs::create_directory(fs::path(path).parent_path());
  std::vector<std::thread> writers;
  std::atomic<int> failures = 0;
  for (int i = 0; i < 4; ++i)
    writers.emplace_back([&] {
      try {
        for (int j = 0; j < 50; ++j) space.write_model(space.photograph(0), "", path);
      } catch (const solidtex::error&) {
        ++failures;
      }
    });
  for (std::thread& writer : writers) writer.join();
  CHECK(failures == 0);
  CHECK_NOTHROW(solidtex::texture(path));
  const fs::directory_iterator entries(fs::path(path).parent_path());
  CHECK(std::distance(begin(entries), end(entries)) == 1);
}

TEST_CASE("A texture of a code has the bits of the written model, and both are the space's") {
  const TemporaryFolder folder;
  write_tiny_space(folder.file("tiny.solidtex-space"));
  const solidtex::space space(folder.file("tiny.solidtex-space"));
  const solidtex::material chosen = space.photograph(1);
  space.write_model(chosen, R"({"name": "mine"})", folder.file("mine.solidtex"));
  const solidtex::texture written(folder.file("mine.solidtex")), opened = space.open(chosen);
  CHECK(voxels(written) == voxels(opened));
  CHECK(voxels(opened) != voxels(space.open(space.photograph(0))));
  CHECK(written.name() == "mine");
  CHECK(opened.name() == "tiny");
  CHECK(contains(written.metadata_json(), space.sha256()));
}

TEST_CASE("A blend lies between its materials, and its weights are relative") {
  const TemporaryFolder folder;
  write_tiny_space(folder.file("tiny.solidtex-space"));
  const solidtex::space space(folder.file("tiny.solidtex-space"));
  const std::vector<solidtex::material> both{space.photograph(0), space.photograph(1)};
  const auto blended = space.blend(both, std::array{1.0, 3.0});
  for (std::size_t i = 0; i < 2; ++i)
    CHECK(std::abs(blended.code[i] - (0.25f * both[0].code[i] + 0.75f * both[1].code[i])) < 1e-6f);
  for (std::size_t r = 0; r < 3; ++r) {
    const float mean = 0.25f * both[0].colors[4 * r + 3] + 0.75f * both[1].colors[4 * r + 3];
    CHECK(std::abs(blended.colors[4 * r + 3] - mean) < 1e-6f);
  }
  const auto tenfold = space.blend(both, std::array{10.0, 30.0});
  CHECK(tenfold.code == blended.code);
  CHECK(tenfold.colors == blended.colors);
  CHECK_THROWS_WITH(space.blend(both, std::array{1.0, -1.0}),
                    "the sum of weights is 0.000000, expected a positive number");
}

TEST_CASE("Several spaces are used by several threads at once") {
  const TemporaryFolder folder;
  std::vector<solidtex::space> spaces;
  std::vector<Values> expected;
  for (int i = 0; i < 3; ++i) {
    const std::string file = folder.file(std::to_string(i) + ".solidtex-space");
    write_tiny_space(file, 0.03f * static_cast<float>(i));
    spaces.emplace_back(file);
    expected.push_back(voxels(spaces.back().open(spaces.back().photograph(0))));
  }
  CHECK(expected[0] != expected[1]);
  std::array<bool, 6> same{};
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < same.size(); ++t)
    threads.emplace_back([&, t] {
      const solidtex::space space = spaces[t % 3];
      same[t] = true;
      for (int k = 0; k < 20; ++k)
        same[t] = same[t] && voxels(space.open(space.photograph(0))) == expected[t % 3];
    });
  for (std::thread& thread : threads) thread.join();
  for (const bool one : same) CHECK(one);
}

TEST_CASE("A texture outlives its space") {
  const TemporaryFolder folder;
  write_tiny_space(folder.file("tiny.solidtex-space"));
  auto space = std::make_unique<solidtex::space>(folder.file("tiny.solidtex-space"));
  const solidtex::texture texture = space->open(space->photograph(0));
  const Values before = voxels(texture);
  space.reset();
  CHECK(voxels(texture) == before);
}

TEST_CASE("Misuse is refused with a message that names the argument") {
  const TemporaryFolder folder;
  write_tiny_space(folder.file("tiny.solidtex-space"));
  solidtex_clear_error();
  solidtex_space* space = solidtex_space_open(folder.file("tiny.solidtex-space").c_str());
  REQUIRE(space);
  solidtex_texture* texture = solidtex_new();
  std::array<float, 2> code{};
  std::array<float, 12> colors{};
  const double weight = 1;

  CHECK(contains(
      message_of(solidtex_space_texture(nullptr, code.data(), colors.data(), nullptr, texture)),
      "space is null"));
  CHECK(
      contains(message_of(solidtex_space_texture(space, nullptr, colors.data(), nullptr, texture)),
               "code is null"));
  CHECK(contains(message_of(solidtex_space_texture(space, code.data(), nullptr, nullptr, texture)),
                 "colors is null"));
  CHECK(contains(
      message_of(solidtex_space_texture(space, code.data(), colors.data(), nullptr, nullptr)),
      "texture is null"));
  CHECK(contains(
      message_of(solidtex_space_texture(space, code.data(), colors.data(), "[1]", texture)),
      "expected a JSON object"));
  CHECK(contains(message_of(solidtex_space_texture(space, code.data(), colors.data(),
                                                   R"({"noise": {}})", texture)),
                 "noise: found an unknown key"));
  CHECK(contains(message_of(solidtex_space_texture(space, code.data(), colors.data(),
                                                   R"({"training": {"space": {}}})", texture)),
                 "training.space"));
  code[1] = std::numeric_limits<float>::quiet_NaN();
  CHECK(contains(
      message_of(solidtex_space_texture(space, code.data(), colors.data(), nullptr, texture)),
      "code[1] is nan"));
  code[1] = 1e38f;
  colors[0] = 1e38f;
  CHECK(contains(
      message_of(solidtex_space_texture(space, code.data(), colors.data(), nullptr, texture)),
      "expected finite values"));
  code[1] = colors[0] = 0;
  CHECK(contains(message_of(solidtex_space_blend(space, 0, &weight, code.data(), colors.data(),
                                                 code.data(), colors.data())),
                 "count is 0"));
  CHECK(contains(message_of(solidtex_space_photograph(space, 2, code.data(), nullptr)),
                 "index is 2, expected less than 2"));
  CHECK(contains(message_of(solidtex_space_write_model(space, code.data(), colors.data(), nullptr,
                                                       folder.file("no/m.solidtex").c_str())),
                 "cannot write"));
  CHECK(contains(message_of(solidtex_space_encode(space, nullptr, 16, 16, SOLIDTEX_PATCHES_AVERAGE,
                                                  code.data(), colors.data())),
                 "pixels is null"));
  CHECK(contains(
      message_of(solidtex_space_encode(space, colors.data(), 15, 99, SOLIDTEX_PATCHES_AVERAGE,
                                       code.data(), colors.data())),
      "15 x 99 pixels, expected at least 16 x 16"));
  CHECK(solidtex_space_texture(space, code.data(), colors.data(), "", texture) == SOLIDTEX_OK);
  CHECK(contains(message_of(solidtex_space_texture(space, code.data(), colors.data(), "", texture)),
                 "open already"));
  CHECK(solidtex_space_name(nullptr) == nullptr);
  CHECK(solidtex_space_code_size(nullptr) == 0);
  solidtex_clear_error();
  solidtex_release(texture);
  solidtex_space_retain(space);
  solidtex_space_release(space);
  solidtex_space_release(space);
  solidtex_space_release(nullptr);
}

TEST_CASE("A name that no space has is refused with the places that were searched") {
  CHECK_THROWS_WITH(solidtex::space("no-such-space"),
                    ContainsSubstring("no texture space is named \"no-such-space\"") &&
                        ContainsSubstring(".solidtex-space)"));
}
