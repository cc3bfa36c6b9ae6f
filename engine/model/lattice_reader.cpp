// Reader of the lattice family: the graph, resolved to indices, levels and channels.
#include <map>

#include "engine/model/readers.h"

namespace solidtex::engine {
namespace {

constexpr std::size_t max_nodes = 4096;
constexpr std::int64_t max_channels = 4096, max_level = 20;
constexpr std::int64_t max_word = 0xFFFFFFFF;
constexpr std::int64_t max_conv_kernel = 15, max_transpose_kernel = 16;

// Input of a node's reader: its JSON object, the nodes before it, and the tensors.
struct Context {
  const Fields& fields;
  const std::vector<Node>& nodes;
  const std::map<std::string, int>& indices;
  NoiseScheme noise_scheme;
  TensorSource& tensors;

  std::vector<int> inputs(std::size_t low, std::size_t high) const;
  int input() const { return inputs(1, 1).front(); }
};

std::vector<int> Context::inputs(std::size_t low, std::size_t high) const {
  std::vector<int> result;
  for (const auto& name : fields.array("inputs", low, high)) {
    const std::string where = fields.path("inputs") + "[" + std::to_string(result.size()) + "]";
    check_name(fields.label(), where, name);
    const auto found = indices.find(name.get<std::string>());
    if (found == indices.end())
      throw invalid(fields.label(), where, show(name), "the name of an earlier node");
    result.push_back(found->second);
  }
  return result;
}

int finer_level(const Context& context, const Node& source) {
  if (source.level == 0) throw context.fields.wrong("inputs", "an input on level 1 or coarser");
  return source.level - 1;
}

// Returns a node with the level and channels of its only input.
Node pointwise(const Context& context, Op op) {
  const int input = context.input();
  const Node& source = context.nodes[static_cast<std::size_t>(input)];
  return {context.fields.string("name"), std::move(op), {input}, source.level, source.channels};
}

Node read_noise(const Context& context) {
  const Fields& fields = context.fields;
  fields.allow_only({"name", "op", "level", "channels", "distribution"});
  const bool normal = fields.choice("distribution", {"uniform", "normal"}) == "normal";
  if (normal && context.noise_scheme == NoiseScheme::solidtexturenets)
    throw fields.wrong("distribution", "\"uniform\", the only one of scheme \"solidtexturenets\"");
  const auto level = fields.integer("level", 0, max_level);
  const auto channels = fields.integer("channels", 1, max_channels);
  return {fields.string("name"),
          NoiseOp{normal ? Distribution::normal : Distribution::uniform},
          {},
          static_cast<int>(level),
          static_cast<int>(channels)};
}

std::uint32_t read_word(const Context& context, const std::string& where,
                        const nlohmann::json& value) {
  const auto word = as_integer(value);
  if (!word || *word < 0 || *word > max_word)
    throw invalid(context.fields.label(), where, show(value),
                  "an integer from 0 to " + std::to_string(max_word));
  return static_cast<std::uint32_t>(*word);
}

Node read_periodic(const Context& context) {
  const Fields& fields = context.fields;
  fields.allow_only({"name", "op", "level", "waves"});
  PeriodicOp op;
  for (const auto& value : fields.array("waves", 1, max_channels)) {
    const std::string where = fields.path("waves") + "[" + std::to_string(op.waves.size()) + "]";
    if (!value.is_array() || value.size() != 4)
      throw invalid(fields.label(), where, show(value), "an array of 4 integers");
    Wave wave;
    for (std::size_t axis = 0; axis < 3; ++axis)
      wave.frequency[axis] =
          read_word(context, where + "[" + std::to_string(axis) + "]", value[axis]);
    wave.phase = read_word(context, where + "[3]", value[3]);
    op.waves.push_back(wave);
  }
  const auto level = fields.integer("level", 0, max_level);
  const auto channels = static_cast<int>(op.waves.size());
  return {fields.string("name"), std::move(op), {}, static_cast<int>(level), channels};
}

Node read_conv3d(const Context& context) {
  const Fields& fields = context.fields;
  fields.allow_only({"name", "op", "inputs", "out_channels", "kernel"});
  Node node = pointwise(context, Conv3dOp{});
  const std::int64_t in = node.channels;
  const std::int64_t out = fields.integer("out_channels", 1, max_channels);
  const std::int64_t kernel = fields.integer("kernel", 1, max_conv_kernel);
  if (kernel % 2 == 0) throw fields.wrong("kernel", "an odd integer");
  node.op = Conv3dOp{static_cast<int>(kernel),
                     context.tensors.take(node.name + ".weight", {out, in, kernel, kernel, kernel}),
                     context.tensors.take(node.name + ".bias", {out})};
  node.channels = static_cast<int>(out);
  return node;
}

Node read_conv_transpose3d(const Context& context) {
  const Fields& fields = context.fields;
  fields.allow_only({"name", "op", "inputs", "out_channels", "kernel", "padding"});
  Node node = pointwise(context, ConvTranspose3dOp{});
  const std::int64_t in = node.channels;
  const std::int64_t out = fields.integer("out_channels", 1, max_channels);
  const std::int64_t kernel = fields.integer("kernel", 1, max_transpose_kernel);
  const std::int64_t padding = fields.integer("padding", 0, kernel - 1);
  node.level = finer_level(context, node);
  node.op = ConvTranspose3dOp{
      static_cast<int>(kernel), static_cast<int>(padding),
      context.tensors.take(node.name + ".weight", {in, out, kernel, kernel, kernel}),
      context.tensors.take(node.name + ".bias", {out})};
  node.channels = static_cast<int>(out);
  return node;
}

Node read_upsample(const Context& context) {
  context.fields.allow_only({"name", "op", "inputs"});
  Node node = pointwise(context, UpsampleOp{});
  node.level = finer_level(context, node);
  return node;
}

Node read_concat(const Context& context) {
  const Fields& fields = context.fields;
  fields.allow_only({"name", "op", "inputs"});
  const auto inputs = context.inputs(2, static_cast<std::size_t>(max_channels));
  const int level = context.nodes[static_cast<std::size_t>(inputs.front())].level;
  int channels = 0;  // at most 4096 inputs of at most 4096 channels
  for (const int input : inputs) {
    const Node& source = context.nodes[static_cast<std::size_t>(input)];
    if (source.level != level)
      throw invalid(fields.label(), fields.path("inputs"),
                    "levels " + std::to_string(level) + " and " + std::to_string(source.level),
                    "inputs on one level");
    channels += source.channels;
  }
  return {fields.string("name"), ConcatOp{}, inputs, level, channels};
}

Node read_affine(const Context& context) {
  context.fields.allow_only({"name", "op", "inputs"});
  Node node = pointwise(context, AffineOp{});
  const std::vector<std::int64_t> shape{node.channels};
  node.op = AffineOp{context.tensors.take(node.name + ".scale", shape),
                     context.tensors.take(node.name + ".shift", shape)};
  return node;
}

Node read_leaky_relu(const Context& context) {
  context.fields.allow_only({"name", "op", "inputs", "slope"});
  return pointwise(context, LeakyReluOp{static_cast<float>(context.fields.number("slope", 0, 1))});
}

Node read_tanh(const Context& context) {
  context.fields.allow_only({"name", "op", "inputs"});
  return pointwise(context, TanhOp{});
}

Node read_sigmoid(const Context& context) {
  context.fields.allow_only({"name", "op", "inputs"});
  return pointwise(context, SigmoidOp{});
}

Node read_softmax(const Context& context) {
  context.fields.allow_only({"name", "op", "inputs"});
  return pointwise(context, SoftmaxOp{});
}

struct Reader {
  const char* op;
  Node (*read)(const Context&);
};
constexpr Reader readers[] = {
    {"noise", read_noise},       {"periodic", read_periodic},
    {"conv3d", read_conv3d},     {"conv_transpose3d", read_conv_transpose3d},
    {"upsample", read_upsample}, {"concat", read_concat},
    {"affine", read_affine},     {"leaky_relu", read_leaky_relu},
    {"tanh", read_tanh},         {"sigmoid", read_sigmoid},
    {"softmax", read_softmax}};

Node read_node(const Context& context) {
  const Fields& fields = context.fields;
  const std::string name = fields.name("name");
  if (context.indices.contains(name)) throw fields.wrong("name", "a name that no earlier node has");
  const auto* op = fields.value("op").get_ptr<const std::string*>();
  std::vector<std::string> ops;
  for (const Reader& reader : readers) {
    if (op && *op == reader.op) {
      Node node = reader.read(context);
      if (node.channels <= max_channels) return node;
      throw invalid(fields.label(), fields.where() + " (" + show(name) + ")",
                    std::to_string(node.channels) + " channels",
                    "1 to " + std::to_string(max_channels));
    }
    ops.emplace_back(reader.op);
  }
  fields.choice("op", ops);  // throws
  return {};
}

// Nodes refer only backwards and all are used, so the output is the last one.
void check_output(const Fields& lattice, const std::vector<Node>& nodes,
                  std::size_t channel_count) {
  const Node& output = nodes.back();
  if (lattice.name("output") != output.name)
    throw lattice.wrong("output", "the last node, " + show(output.name));
  const std::string where = lattice.path("output") + " (" + show(output.name) + ")";
  if (output.level != 0)
    throw invalid(lattice.label(), where, "level " + std::to_string(output.level), "level 0");
  if (static_cast<std::size_t>(output.channels) != channel_count)
    throw invalid(lattice.label(), where, std::to_string(output.channels) + " channels",
                  std::to_string(channel_count) + ", as in channels");
}

void check_all_used(const Fields& lattice, const std::vector<Node>& nodes) {
  std::vector<bool> used(nodes.size());
  for (const Node& node : nodes)
    for (const int input : node.inputs) used[static_cast<std::size_t>(input)] = true;
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i)
    if (!used[i])
      throw invalid(lattice.label(),
                    lattice.path("nodes[" + std::to_string(i) + "] (" + show(nodes[i].name) + ")"),
                    "a node that nothing uses", "a use in the graph");
}

}  // namespace

LatticeModel read_lattice(const Fields& lattice, const Model& model, TensorSource& tensors) {
  lattice.allow_only({"nodes", "output"});
  LatticeModel result;
  std::map<std::string, int> indices;
  for (const auto& value : lattice.array("nodes", 1, max_nodes)) {
    const int index = static_cast<int>(result.nodes.size());
    const Fields fields(lattice.label(), lattice.path("nodes[" + std::to_string(index) + "]"),
                        value);
    result.nodes.push_back(read_node({fields, result.nodes, indices, model.noise_scheme, tensors}));
    indices[result.nodes.back().name] = index;
  }
  check_output(lattice, result.nodes, model.channels.size());
  check_all_used(lattice, result.nodes);
  check_voxel_cost(lattice, result.nodes);
  return result;
}

}  // namespace solidtex::engine
