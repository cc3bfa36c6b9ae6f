// Float64 loops in the order of indices, with + - * / and comparisons only; each result is rounded
// to float32 once. So the same code gives the same bytes on every machine.
#include "engine/space/decode.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "engine/model/checks.h"
#include "engine/model/container.h"
#include "engine/model/json_text.h"

namespace solidtex::engine {
namespace {

using Vector = std::vector<double>;
using Tensors = std::map<std::string, Tensor>;

double leaky_relu(double x, double slope) { return x > 0 ? x : slope * x; }

Tensor rounded(std::vector<std::int64_t> shape, const Vector& values) {
  Tensor tensor{std::move(shape), std::vector<float>(values.size())};
  std::ranges::transform(values, tensor.values.begin(),
                         [](double value) { return static_cast<float>(value); });
  return tensor;
}

// Weight [rows][columns], flat, and bias of a layer.
struct Layer {
  Vector weight, bias;

  std::size_t columns() const { return weight.size() / bias.size(); }

  // Returns W x + b.
  Vector operator()(const Vector& x) const {
    Vector y = bias;
    for (std::size_t i = 0; i < y.size(); ++i)
      for (std::size_t j = 0; j < x.size(); ++j) y[i] += weight[i * x.size() + j] * x[j];
    return y;
  }

  // Scale and shift of the outputs.
  void scale_rows(const Vector& scale, const Vector& shift) {
    const std::size_t n = columns();
    for (std::size_t i = 0; i < bias.size(); ++i) {
      for (std::size_t j = 0; j < n; ++j) weight[i * n + j] *= scale[i];
      bias[i] = bias[i] * scale[i] + shift[i];
    }
  }

  // Scale and shift of the inputs.
  void scale_columns(const Vector& scale, const Vector& shift) {
    bias = (*this)(shift);
    const std::size_t n = columns();
    for (std::size_t i = 0; i < bias.size(); ++i)
      for (std::size_t j = 0; j < n; ++j) weight[i * n + j] *= scale[j];
  }

  // Turns three whitened outputs into colors.
  void apply(const Colors& colors) {
    const std::size_t n = columns();
    Layer result{Vector(3 * n), Vector(3)};
    for (std::size_t r = 0; r < 3; ++r) {
      result.bias[r] = colors[4 * r + 3];
      for (std::size_t k = 0; k < 3; ++k) {
        const double axis = colors[4 * r + k];
        result.bias[r] += axis * bias[k];
        for (std::size_t j = 0; j < n; ++j) result.weight[r * n + j] += axis * weight[k * n + j];
      }
    }
    *this = std::move(result);
  }
};

// Scale and shift of a layer's channels.
struct Condition {
  Vector gamma, delta;
};

class Decoder {
 public:
  Decoder(const Space& space, const Material& material)
      : space_(space), code_(material.code.begin(), material.code.end()), colors_(material.colors) {
    if (std::holds_alternative<NoGenerator>(space.sizes))
      throw invalid(space.label, "family", "\"none\"",
                    "\"lattice\" or \"sampler\": this space is an encoder alone, without models");
    style_ = two_layers("style");
  }

  Tensors operator()(const LatticeSizes& sizes) const {
    Tensors tensors;
    for (const Convolution& c : lattice_convolutions(sizes)) {
      Layer folded = layer(c.name);
      if (c.is_last) {
        apply_colors(folded);
      } else {
        const auto [gamma, delta] = condition(c.name);
        folded.scale_rows(gamma, delta);
      }
      store(tensors, c.name, folded);
    }
    return tensors;
  }

  Tensors operator()(const NoGenerator&) const { return {}; }

  Tensors operator()(const SamplerSizes& sizes) const {
    Tensors tensors;
    tensors["constant"] = tensor("constant");
    tensors["transforms"] = transforms(sizes);
    std::optional<Condition> before;
    for (int l = 0; l <= sizes.hidden_layers; ++l) {
      const bool is_output = l == sizes.hidden_layers;
      const std::string name = is_output ? "output" : "hidden." + std::to_string(l);
      Layer folded = layer(name);
      if (before) folded.scale_columns(before->gamma, before->delta);
      if (is_output) {
        apply_colors(folded);
      } else {
        before = condition(name);
        if (l + 1 < sizes.hidden_layers) tensors[name + ".noise"] = tensor(name + ".noise");
      }
      store(tensors, name, folded);
    }
    return tensors;
  }

 private:
  const Tensor& tensor(const std::string& name) const { return space_.tensors.at(name); }

  Vector values(const std::string& name) const {
    const std::vector<float>& found = tensor(name).values;
    return {found.begin(), found.end()};
  }

  Layer layer(const std::string& name) const {
    return {values(name + ".weight"), values(name + ".bias")};
  }

  void store(Tensors& tensors, const std::string& name, const Layer& folded) const {
    tensors[name + ".weight"] = rounded(tensor(name + ".weight").shape, folded.weight);
    tensors[name + ".bias"] = rounded(tensor(name + ".bias").shape, folded.bias);
  }

  // f or Q of the code.
  Vector two_layers(const std::string& name) const {
    Vector hidden = layer(name + ".0")(code_);
    for (double& x : hidden) x = leaky_relu(x, space_.style_slope);
    return layer(name + ".1")(hidden);
  }

  Condition condition(const std::string& name) const {
    const Vector found = layer("condition." + name)(style_);
    const auto middle = found.begin() + static_cast<std::ptrdiff_t>(found.size() / 2);
    Condition result{{found.begin(), middle}, {middle, found.end()}};
    for (double& gamma : result.gamma) gamma += 1;
    return result;
  }

  void apply_colors(Layer& last) const {
    if (space_.has_colors) last.apply(colors_);
  }

  Tensor transforms(const SamplerSizes& sizes) const {
    const Vector q = two_layers("transforms"), scales = values("scales");
    const std::size_t numbers = q.size() / scales.size();
    Vector result;
    for (std::size_t i = 0; i < scales.size(); ++i) {
      const std::span<const double> own(q.data() + i * numbers, numbers);
      if (sizes.has_bounded_transforms)
        append_bounded(own, scales[i], tensor("base").values.data() + 9 * i, result);
      else
        for (const double entry : own) result.push_back(scales[i] * entry);
    }
    return rounded({sizes.octaves, 3, 3}, result);
  }

  // A limited change of the learned transform `base`: a matrix, a scale, and a stretch along z.
  static void append_bounded(std::span<const double> q, double scale, const float* base,
                             Vector& result) {
    const auto soft = [&](std::size_t k) { return q[k] / (1 + (q[k] < 0 ? -q[k] : q[k])); };
    const double t = soft(9) / 2, e = 0.9 * soft(10);
    const double factor = scale * ((1 + t) / (1 - t)), stretch = (1 + e) / (1 - e);
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c) {
        double sum = 0;
        for (std::size_t k = 0; k < 3; ++k)
          sum += ((r == k ? 1 : 0) + soft(3 * r + k) / 2) * base[3 * k + c];
        result.push_back(c == 2 ? factor * sum * stretch : factor * sum);
      }
  }

  const Space& space_;
  Vector code_, style_;
  const Colors& colors_;
};

// Nodes of the lattice generator in the order of exported models.
std::string lattice_graph(const LatticeSizes& sizes) {
  std::vector<ObjectText> nodes;
  const auto begin = [&](const std::string& name, const char* op) -> ObjectText& {
    return nodes.emplace_back().add("name", name).add("op", op);
  };
  const auto add = [&](const std::string& name, const char* op,
                       const std::vector<std::string>& inputs) {
    begin(name, op).add_text("inputs", array_text(inputs));
    return name;
  };
  const auto add_noise = [&](int level) {
    std::string name = "z";  // appended to: GCC 12 warns of "z" + std::to_string(level)
    name += std::to_string(level);
    begin(name, "noise")
        .add("level", level)
        .add("channels", sizes.noise_channels)
        .add("distribution", "uniform");
    return name;
  };
  const auto convolutions = lattice_convolutions(sizes);
  auto next = convolutions.begin();
  const auto add_convolution = [&](const std::string& input) {
    std::string name = add(next->name, "conv3d", {input});
    nodes.back().add("out_channels", next->outputs).add("kernel", next->kernel);
    ++next;
    return name;
  };
  const auto add_block = [&](std::string last) {
    for (int i = 1; i <= 3; ++i) {
      const std::string block = next->name.substr(0, next->name.find('.'));
      last = add(block + ".act" + std::to_string(i), "leaky_relu", {add_convolution(last)});
      nodes.back().add("slope", sizes.negative_slope);
    }
    return last;
  };
  std::string last;
  for (int stage = 1; stage <= sizes.levels; ++stage) {
    if (stage > 1) last = add("up" + std::to_string(stage - 1), "upsample", {last});
    const std::string fine = add_block(add_noise(sizes.levels - stage));
    last =
        stage == 1 ? fine : add_block(add("cat" + std::to_string(stage), "concat", {last, fine}));
  }
  const std::string output = add_convolution(last);
  const auto text = [](const ObjectText& node) { return node.text(); };
  return ObjectText().add_text("nodes", array_text(nodes, text)).add("output", output).text();
}

std::string sampler_graph(const SamplerSizes& sizes) {
  return ObjectText()
      .add("octaves", sizes.octaves)
      .add("hidden_layers", sizes.hidden_layers)
      .add("width", sizes.width)
      .add("slope", sizes.negative_slope)
      .text();
}

// Origin of a model, for its `training`. It marks a license that the model inherits, which is not
// that of the photograph.
std::string origin(const Space& space, const Material& material, bool inherits_license) {
  ObjectText result;
  result.add("name", space.name)
      .add("sha256", space.sha256)
      .add_text("code", array_text(material.code));
  if (inherits_license) result.add("license", space.license);
  if (!space.has_colors) return result.text();
  const auto row = [&](std::size_t r) {
    return array_text(std::span(material.colors.data() + 4 * r, 4));
  };
  return result.add_text("colors", '[' + row(0) + ',' + row(1) + ',' + row(2) + ']').text();
}

// Returns the model's document.
std::string describe(const Space& space, const Material& material, const std::string& details) {
  const JsonDocument parsed(space.label, "details", details.empty() ? "{}" : details);
  const nlohmann::json& given = parsed.root();
  const Fields fields(space.label + ": details", "", given);
  fields.allow_only({"name", "license", "exemplar", "training"});
  const LatticeSizes* lattice = std::get_if<LatticeSizes>(&space.sizes);
  const std::string family = lattice ? "field" : "sampler";
  const auto text_of = [&](const char* key) { return fields.value(key).dump(); };
  const bool inherits_license = !fields.contains("license") && !space.license.empty();
  ObjectText training;
  training.add_text("space", origin(space, material, inherits_license));
  if (fields.contains("training")) {
    if (fields.child("training").contains("space"))
      throw invalid(fields.label(), "training.space", "this key", "none: the library writes it");
    for (const auto& [key, value] : given["training"].items()) training.add_text(key, value.dump());
  }
  ObjectText document;
  document.add("version", 1)
      .add_text("name", fields.contains("name") ? text_of("name") : scalar_text(space.name))
      .add("family", family)
      .add_text("channels", R"(["albedo.r","albedo.g","albedo.b"])")
      .add("color_space", "srgb")
      .add_text("noise", R"({"scheme":"solidtex-1"})")
      .add_text(family, lattice ? lattice_graph(*lattice)
                                : sampler_graph(std::get<SamplerSizes>(space.sizes)));
  if (fields.contains("exemplar")) document.add_text("exemplar", text_of("exemplar"));
  document.add_text("training", training.text());
  if (fields.contains("license"))
    document.add_text("license", text_of("license"));
  else if (inherits_license)
    document.add("license", space.license);
  return document.text();
}

void check_finite(std::span<const float> values, const std::string& what) {
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!std::isfinite(values[i]))
      throw Error(SOLIDTEX_INVALID_ARGUMENT, what + "[" + std::to_string(i) + "] is " +
                                                 std::to_string(values[i]) +
                                                 ", expected a finite number");
}

}  // namespace

std::vector<std::byte> decode(const Space& space, const Material& material,
                              const std::string& details) {
  check_finite(material.code, "code");
  check_finite(material.colors, "colors");
  const Tensors tensors = std::visit(Decoder(space, material), space.sizes);
  const std::string document = describe(space, material, details);
  return container_bytes(model_file, document, tensors);
}

}  // namespace solidtex::engine
