// An ONNX file is a protobuf message. This walks its fields, by the numbers of onnx.proto3, without
// building anything: an encoder that asks for more than a feed-forward network is refused by name.
#include "engine/space/onnx_file.h"

#include <algorithm>
#include <cstdint>
#include <string_view>

#include "engine/common/error.h"

namespace solidtex::engine {
namespace {

using Bytes = std::span<const std::byte>;

// Feed-forward networks: the output of each is bounded by its input and weights.
constexpr std::string_view known_operators =
    " Abs Add AveragePool BatchNormalization Cast Clip Concat Constant Conv "
    "DequantizeLinear Div Exp Flatten Gemm GlobalAveragePool Identity "
    "InstanceNormalization LeakyRelu Log LpNormalization MatMul Max MaxPool Min Mul Neg "
    "PRelu Pad Pow ReduceMean ReduceSum Relu Reshape Sigmoid Softmax Sqrt Squeeze Sub "
    "Tanh Transpose Unsqueeze ";

// Field numbers.
namespace model {
constexpr std::uint64_t graph = 7, functions = 25;
}
namespace graph {
constexpr std::uint64_t node = 1, initializer = 5, sparse_initializer = 15;
}
namespace node {
constexpr std::uint64_t op_type = 4, attribute = 5, domain = 7;
}
namespace attribute {
constexpr std::uint64_t tensor = 5, graph = 6, graphs = 11;
}
namespace tensor {
constexpr std::uint64_t external_data = 13, data_location = 14;
}

class Checker {
 public:
  explicit Checker(const std::string& where) : where_(where) {}

  void check_model(Bytes message) const {
    bool has_graph = false;
    for_each_field(message, [&](std::uint64_t number, Bytes value) {
      if (number == model::functions) throw refuse("functions", "a plain graph");
      if (number != model::graph) return;
      has_graph = true;
      check_graph(value);
    });
    if (!has_graph) throw damaged();
  }

 private:
  Error refuse(const std::string& found, const std::string& expected) const {
    return Error(SOLIDTEX_INVALID_MODEL, where_ + ": found " + found + ", expected " + expected);
  }
  Error damaged() const { return refuse("no readable ONNX file", "the encoder's ONNX file"); }

  std::uint64_t read_varint(Bytes& rest) const {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      const auto byte = std::to_integer<std::uint64_t>(take(rest, 1)[0]);
      value |= (byte & 0x7F) << shift;
      if (byte < 0x80) return value;
    }
    throw damaged();
  }

  Bytes take(Bytes& rest, std::uint64_t size) const {
    if (size > rest.size()) throw damaged();
    const Bytes taken = rest.first(size);
    rest = rest.subspan(size);
    return taken;
  }

  // Calls use(field number, bytes); the bytes of a field that is a number are left out.
  template <class Use>
  void for_each_field(Bytes message, const Use& use) const {
    while (!message.empty()) {
      const std::uint64_t key = read_varint(message);
      switch (key & 7) {
        case 0:
          read_varint(message);
          use(key >> 3, Bytes{});
          break;
        case 1:
          use(key >> 3, take(message, 8));
          break;
        case 2:
          use(key >> 3, take(message, read_varint(message)));
          break;
        case 5:
          use(key >> 3, take(message, 4));
          break;
        default:
          throw damaged();
      }
    }
  }

  void check_graph(Bytes message) const {
    for_each_field(message, [&](std::uint64_t number, Bytes value) {
      if (number == graph::node) check_node(value);
      if (number == graph::initializer) check_tensor(value);
      if (number == graph::sparse_initializer) throw refuse("sparse weights", "dense ones");
    });
  }

  void check_node(Bytes message) const {
    std::string type, domain;
    for_each_field(message, [&](std::uint64_t number, Bytes value) {
      const std::string_view text(reinterpret_cast<const char*>(value.data()), value.size());
      if (number == node::op_type) type = text;
      if (number == node::domain) domain = text;
      if (number == node::attribute) check_attribute(value);
    });
    const bool is_known = !type.empty() && type.find(' ') == type.npos &&
                          known_operators.find(" " + type + " ") != known_operators.npos;
    if (is_known && (domain.empty() || domain == "ai.onnx")) return;
    throw refuse("the operator " + printable(domain.empty() ? type : domain + "." + type),
                 "one of" + std::string(known_operators) + "of ONNX itself");
  }

  void check_attribute(Bytes message) const {
    for_each_field(message, [&](std::uint64_t number, Bytes value) {
      if (number == attribute::graph || number == attribute::graphs)
        throw refuse("a graph inside a node", "a plain graph");
      if (number == attribute::tensor) check_tensor(value);
    });
  }

  void check_tensor(Bytes message) const {
    for_each_field(message, [&](std::uint64_t number, Bytes) {
      if (number == tensor::external_data || number == tensor::data_location)
        throw refuse("weights in another file", "weights in the ONNX file itself");
    });
  }

  static std::string printable(std::string text) {
    text.resize(std::min<std::size_t>(text.size(), 60));
    std::ranges::replace_if(
        text, [](unsigned char byte) { return byte < 0x20 || byte > 0x7E; }, '?');
    return "\"" + text + "\"";
  }

  const std::string& where_;
};

}  // namespace

void check_onnx(std::span<const std::byte> bytes, const std::string& where) {
  Checker(where).check_model(bytes);
}

}  // namespace solidtex::engine
