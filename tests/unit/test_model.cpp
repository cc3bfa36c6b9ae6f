#include <filesystem>
#include <limits>
#include <random>

#include "catch.hpp"
#include "engine/common/error.h"
#include "engine/model/model.h"
#include "model_bytes.h"

using namespace solidtex::engine;

namespace {

Model parse(const ModelBytes& bytes) { return parse_model(bytes.encode(), "file"); }

std::string error_of(const std::vector<std::byte>& bytes) {
  try {
    parse_model(bytes, "file");
  } catch (const Error& error) {
    REQUIRE(error.status() == SOLIDTEX_INVALID_MODEL);
    return error.what();
  }
  return "accepted";
}

std::string error_of(const ModelBytes& bytes) { return error_of(bytes.encode()); }

// Flips bits, or overwrites, removes or duplicates a range, one to four times.
std::vector<std::byte> mutate(std::vector<std::byte> bytes, std::mt19937& random) {
  const auto below = [&](std::size_t limit) { return random() % limit; };
  for (std::size_t i = 0, count = 1 + below(4); i < count && !bytes.empty(); ++i) {
    const auto at = bytes.begin() + static_cast<std::ptrdiff_t>(below(bytes.size()));
    const auto stretch = static_cast<std::ptrdiff_t>(
        below(std::min<std::size_t>(16, static_cast<std::size_t>(bytes.end() - at)) + 1));
    switch (below(5)) {
      case 0:
        *at ^= std::byte(1u << below(8));
        break;
      case 1:
        *at = std::byte(below(256));
        break;
      case 2:
        bytes.erase(at, at + stretch);
        break;
      case 3:
        bytes.resize(below(bytes.size() + 1));
        break;
      case 4: {
        const std::vector<std::byte> copy(at, at + stretch);
        bytes.insert(at, copy.begin(), copy.end());
      }
    }
  }
  return bytes;
}

}  // namespace

TEST_CASE("A lattice file becomes a resolved graph", "[model]") {
  const ModelBytes bytes = lattice_bytes();
  const Model model = parse(bytes);
  CHECK(model.name == "tiny");
  CHECK(model.channels == std::vector<std::string>{"albedo.r", "roughness"});
  CHECK(model.color_space == "srgb");
  CHECK(model.noise_scheme == NoiseScheme::solidtex_1);
  CHECK(model.metadata_json == bytes.document.dump());
  CHECK(model.parameter_count == 2 * 3 * 27 + 2);

  const auto& nodes = std::get<LatticeModel>(model.architecture).nodes;
  REQUIRE(nodes.size() == 5);
  CHECK(std::get<NoiseOp>(nodes[0].op).distribution == Distribution::uniform);
  CHECK(std::get<NoiseOp>(nodes[1].op).distribution == Distribution::normal);
  CHECK((nodes[0].level == 1 && nodes[2].level == 0 && nodes[4].level == 0));
  CHECK((nodes[3].inputs == std::vector<int>{2, 1} && nodes[3].channels == 3));
  const auto& conv = std::get<Conv3dOp>(nodes[4].op);
  CHECK(conv.kernel == 3);
  CHECK(conv.weight.shape == std::vector<std::int64_t>{2, 3, 3, 3, 3});
  CHECK(conv.weight.values[7] == 0.07f);
  CHECK(conv.bias.values == std::vector<float>{0.5f, 0.51f});
}

TEST_CASE("A sampler file becomes its layers", "[model]") {
  const Model model = parse(sampler_bytes());
  const auto& sampler = std::get<SamplerModel>(model.architecture);
  CHECK((sampler.octaves == 4 && sampler.width == 5 && sampler.negative_slope == 0.25f));
  REQUIRE(sampler.hidden.size() == 3);
  CHECK(sampler.transforms.values[0] == 1);
  CHECK(sampler.constant.values[0] == 2);
  CHECK(sampler.hidden[1].noise.shape == std::vector<std::int64_t>{5, 2});
  CHECK(sampler.hidden[2].noise.values.empty());
  CHECK(sampler.output_bias.shape == std::vector<std::int64_t>{1});
  CHECK(model.parameter_count == 36 + 5 + 3 * 30 + 2 * 10 + 5 + 1);
}

TEST_CASE("An error names file, field, found and expected", "[model]") {
  ModelBytes bytes = lattice_bytes();
  auto& nodes = bytes.document["field"]["nodes"];
  SECTION("a field of the document") {
    nodes[4]["kernel"] = 4;
    CHECK(error_of(bytes) == "file: field.nodes[4].kernel: found 4, expected an odd integer");
  }
  SECTION("a reference") {
    nodes[2]["inputs"][0] = "conv";
    CHECK(error_of(bytes) ==
          "file: field.nodes[2].inputs[0]: found \"conv\", expected the name of an earlier node");
  }
  SECTION("a tensor's shape") {
    nodes[4]["kernel"] = 1;
    CHECK(error_of(bytes) ==
          "file: tensor \"conv.weight\": found shape [2, 3, 3, 3, 3], expected shape "
          "[2, 3, 1, 1, 1]");
  }
  SECTION("a tensor's value") {
    bytes.values.back() = std::numeric_limits<float>::infinity();
    CHECK(error_of(bytes) ==
          "file: tensor \"conv.bias\": found inf at element 1, expected finite values");
  }
  SECTION("a tensor too many") {
    bytes.add("conv.extra", {1});
    CHECK(error_of(bytes) ==
          "file: tensor \"conv.extra\": found shape [1], expected no such tensor in this "
          "architecture");
  }
  SECTION("an extent") {
    bytes.header["conv.bias"]["data_offsets"] = {0, 8};
    CHECK_THAT(error_of(bytes),
               ContainsSubstring("tensor \"conv.") && ContainsSubstring("an overlap at byte 0"));
  }
}

TEST_CASE("A long chain of legal kernels is refused before anything is evaluated", "[model]") {
  ModelBytes bytes = lattice_bytes();
  auto& nodes = bytes.document["field"]["nodes"];
  for (int i = 0; i < 60; ++i) {
    const std::string name = "wide" + std::to_string(i);
    const std::string input = nodes.back()["name"];
    nodes.push_back({{"name", name},
                     {"op", "conv3d"},
                     {"inputs", {input}},
                     {"out_channels", 2},
                     {"kernel", 7}});
    bytes.add(name + ".weight", {2, 2, 7, 7, 7});
    bytes.add(name + ".bias", {2});
  }
  bytes.document["field"]["output"] = "wide59";
  CHECK_THAT(error_of(bytes), ContainsSubstring("operations for one voxel"));
}

TEST_CASE("An unreadable file is refused with the reason", "[model]") {
  const auto missing = std::filesystem::temp_directory_path() / "solidtex-no-such-file.solidtex";
  try {
    read_model(missing);
    FAIL("read");
  } catch (const Error& error) {
    CHECK(error.status() == SOLIDTEX_IO_ERROR);
    CHECK_THAT(error.what(),
               ContainsSubstring(missing.string()) && ContainsSubstring("No such file"));
  }
}

TEST_CASE("Other contents in place of a model are named, with the remedy", "[model]") {
  const auto error_of_text = [](const std::string& text) {
    const auto* first = reinterpret_cast<const std::byte*>(text.data());
    return error_of(std::vector<std::byte>(first, first + text.size()));
  };
  CHECK(error_of_text("version https://git-lfs.github.com/spec/v1\noid sha256:4d7a21\nsize 1\n") ==
        "file: this is a Git LFS pointer, not the model: run git lfs pull");
  for (const char* page : {"<!DOCTYPE html>\n<html>", "\r\n\t <HTML><head>", "<html lang=\"en\">",
                           "\xEF\xBB\xBF<!doctype HTML PUBLIC"})
    CHECK(error_of_text(page) ==
          "file: this is an HTML page, not the model: download the file itself, not its page");
  CHECK_THAT(error_of_text("<?xml version=\"1.0\"?><Error><Code>AccessDenied</Code></Error>"),
             ContainsSubstring("an XML document, not the model"));
  CHECK_THAT(error_of_text("PK\3\4\x14"), ContainsSubstring("a ZIP archive or PyTorch checkpoint"));
  CHECK_THAT(error_of_text("{\"a\": 1, \"b\": 2}"), ContainsSubstring("this is no model"));
  CHECK(error_of_text("") ==
        "file: header length: found an empty file of 0 bytes, expected a model: copy or download "
        "the file again");
  CHECK_THAT(error_of_text("version 2 of something"),
             ContainsSubstring("header length: found ") && ContainsSubstring("this is no model"));
  CHECK_THAT(error_of_text(std::string(300, ' ')), ContainsSubstring("header length: found "));
}

TEST_CASE("Every truncation of a file is refused", "[model]") {
  for (const ModelBytes& valid : {lattice_bytes(), sampler_bytes()}) {
    std::vector<std::byte> bytes = valid.encode();
    while (!bytes.empty()) {
      bytes.pop_back();
      REQUIRE(error_of(bytes).starts_with("file: "));
    }
  }
}

TEST_CASE("Damaged files are refused or read, and never anything else", "[model]") {
  std::mt19937 random(20200605);
  int refused = 0;
  for (const ModelBytes& valid : {lattice_bytes(), sampler_bytes()}) {
    const std::vector<std::byte> bytes = valid.encode();
    for (int i = 0; i < 5000; ++i) refused += error_of(mutate(bytes, random)) != "accepted";
  }
  CHECK(refused > 5000);  // most damage is noticed; a flipped mantissa bit cannot be
  CHECK(refused < 10000);
}
