// Strict reader of .solidtex-space files: the document, then exactly the tensors that it needs.
#include <cstring>

#include "engine/common/sha256.h"
#include "engine/model/checks.h"
#include "engine/model/container.h"
#include "engine/space/onnx_file.h"
#include "engine/space/space.h"

namespace solidtex::engine {
namespace {

constexpr std::int64_t version = 1;
constexpr std::int64_t max_code = 1024, max_style_width = 4096, max_resolution = 1 << 14;
constexpr std::int64_t min_patch = 16, max_patch = 1024;
constexpr std::size_t max_photographs = 1 << 16, max_encoder_bytes = 64 << 20;
constexpr std::int64_t max_levels = 12, max_noise_channels = 64, max_step_channels = 256;
constexpr std::int64_t max_octaves = 256, max_hidden_layers = 64, max_width = 4096;
constexpr std::int64_t bounded_numbers = 11, linear_numbers = 9;  // of Q for one octave

const nlohmann::json albedo = {"albedo.r", "albedo.g", "albedo.b"};

int integer(const Fields& fields, const std::string& key, std::int64_t low, std::int64_t high) {
  return static_cast<int>(fields.integer(key, low, high));
}

LatticeSizes read_lattice_sizes(const Fields& lattice) {
  lattice.allow_only({"levels", "noise_channels", "step_channels", "slope"});
  return {integer(lattice, "levels", 2, max_levels),
          integer(lattice, "noise_channels", 1, max_noise_channels),
          integer(lattice, "step_channels", 1, max_step_channels), lattice.number("slope", 0, 1)};
}

SamplerSizes read_sampler_sizes(const Fields& sampler) {
  sampler.allow_only({"octaves", "hidden_layers", "width", "slope", "transforms"});
  const SamplerSizes sizes{integer(sampler, "octaves", 1, max_octaves),
                           integer(sampler, "hidden_layers", 2, max_hidden_layers),
                           integer(sampler, "width", 1, max_width), sampler.number("slope", 0, 1),
                           sampler.choice("transforms", {"bounded", "linear"}) == "bounded"};
  if (sizes.octaves % (sizes.hidden_layers - 1) != 0)
    throw sampler.wrong("octaves", "a multiple of " + std::to_string(sizes.hidden_layers - 1) +
                                       ", hidden_layers - 1");
  return sizes;
}

void expect_none(const Fields& document, const std::string& key, const std::string& expected) {
  if (document.contains(key)) throw invalid(document.label(), key, "this key", expected);
}

// Returns the width of the style, 0 where there is no generator.
std::int64_t read_generator(const Fields& document, Space& space) {
  const std::string family = document.choice("family", {"lattice", "sampler", "none"});
  if (family == "none") {
    for (const char* key : {"lattice", "sampler", "noise", "style"})
      expect_none(document, key, "none of a generator's: the family is \"none\"");
    document.choice("colors", {"network"});
    space.sizes = NoGenerator{};
    return 0;
  }
  expect_none(document, family == "lattice" ? "sampler" : "lattice",
              "only " + family + ", the key of the family");
  if (family == "lattice")
    space.sizes = read_lattice_sizes(document.child(family));
  else
    space.sizes = read_sampler_sizes(document.child(family));
  document.child("noise").allow_only({"scheme"});
  document.child("noise").choice("scheme", {"solidtex-1"});
  const Fields style = document.child("style");
  style.allow_only({"width", "slope"});
  space.style_slope = style.number("slope", 0, 1);
  return style.integer("width", 1, max_style_width);
}

void read_photographs(const Fields& document, Space& space) {
  for (const auto& value : document.array("photographs", 1, max_photographs)) {
    const std::string where = "photographs[" + std::to_string(space.photographs.size()) + "]";
    const Fields photograph(document.label(), where, value);
    photograph.allow_only({"name", "sha256", "license", "source"});
    for (const char* key : {"sha256", "license", "source"})
      if (photograph.contains(key)) photograph.string(key);
    space.photographs.push_back({photograph.name("name"), {}});
  }
}

// Returns the width of the style.
std::int64_t read_document(const Fields& document, Space& space) {
  document.integer("version", version, version);
  document.allow_only({"version", "name", "family", "channels", "color_space", "colors", "patch",
                       "resolution", "code", "directions", "noise", "lattice", "sampler", "style",
                       "photographs", "license", "training"});
  space.name = document.name("name");
  if (document.value("channels") != albedo) throw document.wrong("channels", show(albedo));
  document.choice("color_space", {"srgb"});
  space.has_colors = document.choice("colors", {"photograph", "network"}) == "photograph";
  space.patch = integer(document, "patch", min_patch, max_patch);
  space.resolution = integer(document, "resolution", space.patch, max_resolution);
  space.code_size = static_cast<std::size_t>(document.integer("code", 1, max_code));
  space.is_upright = document.choice("directions", {"xyz", "xy"}) == "xy";
  const std::int64_t style_width = read_generator(document, space);
  read_photographs(document, space);
  if (document.contains("training")) document.child("training");
  if (document.contains("license")) space.license = document.string("license");
  return style_width;
}

// Takes the tensors of a space by name and keeps them.
class TensorReader {
 public:
  TensorReader(Space& space, TensorSource& source, std::int64_t style_width)
      : space_(space), source_(source), style_width_(style_width) {}

  void take(const std::string& name, const std::vector<std::int64_t>& shape) {
    space_.tensors[name] = source_.take(name, shape);
  }
  void layer(const std::string& name, std::int64_t outputs, std::int64_t inputs) {
    take(name + ".weight", {outputs, inputs});
    take(name + ".bias", {outputs});
  }
  // f or Q: the code, a hidden layer, `outputs` numbers.
  void two_layers(const std::string& name, std::int64_t outputs) {
    layer(name + ".0", style_width_, static_cast<std::int64_t>(space_.code_size));
    layer(name + ".1", outputs, style_width_);
  }
  void condition(const std::string& name, std::int64_t channels) {
    layer("condition." + name, 2 * channels, style_width_);
  }

  void operator()(const LatticeSizes& sizes) {
    two_layers("style", style_width_);
    for (const Convolution& c : lattice_convolutions(sizes)) {
      const std::int64_t k = c.kernel;
      take(c.name + ".weight", {c.outputs, c.inputs, k, k, k});
      take(c.name + ".bias", {c.outputs});
      if (!c.is_last) condition(c.name, c.outputs);
    }
  }
  void operator()(const SamplerSizes& sizes) {
    const std::int64_t n = sizes.octaves, m = sizes.width, bins = sizes.hidden_layers - 1;
    two_layers("style", style_width_);
    two_layers("transforms", n * (sizes.has_bounded_transforms ? bounded_numbers : linear_numbers));
    take("scales", {n});
    if (sizes.has_bounded_transforms) take("base", {n, 3, 3});
    take("constant", {m});
    for (std::int64_t l = 0; l <= bins; ++l) {
      const std::string name = "hidden." + std::to_string(l);
      layer(name, m, m);
      if (l < bins) take(name + ".noise", {m, n / bins});
      condition(name, m);
    }
    layer("output", 3, m);
  }
  void operator()(const NoGenerator&) {}

 private:
  Space& space_;
  TensorSource& source_;
  std::int64_t style_width_;
};

void read_photograph_tensors(TensorSource& source, Space& space) {
  const auto count = static_cast<std::int64_t>(space.photographs.size());
  const Tensor codes = source.take("codes", {count, static_cast<std::int64_t>(space.code_size)});
  const Tensor colors = space.has_colors ? source.take("colors", {count, 3, 4}) : Tensor{};
  for (std::size_t i = 0; i < space.photographs.size(); ++i) {
    Material& material = space.photographs[i].material;
    const float* code = codes.values.data() + i * space.code_size;
    material.code.assign(code, code + space.code_size);
    if (!space.has_colors) continue;
    std::memcpy(material.colors.data(), colors.values.data() + i * material.colors.size(),
                sizeof material.colors);
  }
}

}  // namespace

std::vector<Convolution> lattice_convolutions(const LatticeSizes& sizes) {
  std::vector<Convolution> result;
  const auto add_block = [&](const std::string& block, int inputs, int outputs) {
    result.push_back({block + ".conv1", inputs, outputs, 3});
    result.push_back({block + ".conv2", outputs, outputs, 3});
    result.push_back({block + ".conv3", outputs, outputs, 1});
  };
  for (int stage = 1; stage <= sizes.levels; ++stage) {
    const std::string block = "cb" + std::to_string(stage);
    const int width = stage * sizes.step_channels;
    add_block(block + "_1", sizes.noise_channels, sizes.step_channels);
    if (stage > 1) add_block(block + "_2", width, width);
  }
  result.push_back({"last_conv", sizes.levels * sizes.step_channels, 3, 1, true});
  return result;
}

Space parse_space(std::span<const std::byte> bytes, const std::string& label) {
  const Container container = parse_container(bytes, label, space_file);
  Space space;
  space.label = label;
  space.metadata_json = container.document;
  const JsonDocument json(label, "__metadata__.solidtex-space", container.document);
  const std::int64_t style_width = read_document(Fields(label, "", json.root()), space);
  TensorSource source(label, container.tensors);
  std::visit(TensorReader(space, source, style_width), space.sizes);
  read_photograph_tensors(source, space);
  space.encoder = source.take_bytes("encoder", max_encoder_bytes);
  check_onnx(space.encoder, label + ": tensor \"encoder\"");
  source.expect_all_taken();
  space.sha256 = sha256(bytes);
  return space;
}

Space read_space(const std::filesystem::path& path) {
  return parse_space(read_bytes(path), path.string());
}

}  // namespace solidtex::engine
