#include "tools/info/report.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <stdexcept>

#include "tools/common/graph.h"

namespace solidtex::tools {
namespace {

using nlohmann::ordered_json;

constexpr int label_width = 14;
constexpr std::size_t max_text = 160;

std::vector<float> evaluate_voxel(const solidtex::texture& texture) {
  std::vector<float> values(texture.channel_count());
  texture.eval_box({0, 0, 0}, {1, 1, 1}, values);
  for (std::size_t channel = 0; channel < values.size(); ++channel)
    if (!std::isfinite(values[channel]))
      throw std::runtime_error(texture.path() + ": voxel (0, 0, 0), channel " +
                               texture.channel_name(channel) + ": found " +
                               std::to_string(values[channel]) + ", expected a finite value");
  return values;
}

ordered_json describe_nodes(const nlohmann::json& lattice) {
  const std::vector<GraphNode> nodes = describe_graph(lattice);
  ordered_json result = ordered_json::array();
  for (const GraphNode& node : nodes) {
    ordered_json inputs = ordered_json::array();
    for (const std::size_t input : node.inputs) inputs.push_back(nodes[input].name);
    result.push_back({{"name", node.name},
                      {"op", node.op},
                      {"inputs", inputs},
                      {"level", node.level},
                      {"channels", node.channels},
                      {"voxel_region", {node.region_low, node.region_high}}});
  }
  return result;
}

// One short line. Control characters are escaped, U+0080 to U+009F (C2 80 to C2 9F) too: a file
// must not control the terminal.
std::string text_of(const ordered_json& value) {
  std::string text = to_text(value, -1);
  const auto is_c1 = [](char a, char b) {
    return a == '\xC2' && static_cast<unsigned char>(b) < 0xA0;
  };
  if (std::ranges::adjacent_find(text, is_c1) != text.end())
    text = value.dump(-1, ' ', true, ordered_json::error_handler_t::replace);
  if (value.is_string()) text = text.substr(1, text.size() - 2);
  if (text.size() > max_text) text = text.substr(0, max_text - 3) + "...";
  return text;
}

std::string join(const ordered_json& strings) {
  std::string result;
  for (const ordered_json& string : strings) {
    if (!result.empty()) result += ' ';
    result += string.get_ref<const std::string&>();
  }
  return result;
}

void print_line(std::ostream& out, const std::string& label, const std::string& text) {
  out << "  " << std::left << std::setw(label_width) << label << text << '\n';
}

// One line per entry, the first beside the label.
void print_object(std::ostream& out, const std::string& label, const ordered_json& object) {
  std::string beside = label;
  for (const auto& [key, value] : object.items()) {
    print_line(out, beside, text_of(key) + ": " + text_of(value));
    beside.clear();
  }
}

// The settings of a training that most people ask for, in one line.
void print_training(std::ostream& out, const ordered_json& training) {
  std::string text;
  const char* preset = training.contains("preset") ? "preset" : "method_name";  // of older models
  for (const char* key : {preset, "step", "seconds", "resolution", "directions", "seed"}) {
    const auto found = training.find(key);
    if (found == training.end() || found->is_null()) continue;
    if (!text.empty()) text += ", ";
    text += std::string(key == preset ? "preset" : key) + " ";
    text += found->is_number_float() ? std::to_string(std::llround(found->get<double>()))
                                     : text_of(*found);
  }
  text.empty() ? print_object(out, "training", training) : print_line(out, "training", text);
}

// A model's own license, or the one that it inherits from its texture space.
std::string license_of(const ordered_json& report) {
  if (!report.contains("license")) return "not stated";
  const ordered_json training = report.value("training", ordered_json::object());
  const ordered_json space =
      training.is_object() ? training.value("space", ordered_json()) : ordered_json();
  const bool is_inherited = space.is_object() && space.contains("license");
  return text_of(report["license"]) +
         (is_inherited ? ", of the texture space; of the material: not stated" : "");
}

void print_exemplar(std::ostream& out, const ordered_json& exemplar) {
  if (!exemplar.is_array()) return print_object(out, "exemplar", exemplar);
  for (const ordered_json& one : exemplar) print_object(out, "exemplar", one);
}

// The lines that only a texture space has.
void print_space(std::ostream& out, const ordered_json& report) {
  if (report.contains("lattice")) print_object(out, "lattice", report["lattice"]);
  print_line(out, "code",
             text_of(report["code"]) + " numbers, colors of the " + text_of(report["colors"]));
  print_line(out, "patch",
             text_of(report["patch"]) + " pixels, photographs of at most " +
                 text_of(report["resolution"]) + " on the shorter side");
  print_line(out, "SHA-256", text_of(report["sha256"]));
  std::string beside = "photographs";
  for (const ordered_json& photograph : report["photographs"]) {
    std::string text = text_of(photograph["name"]);
    if (photograph.contains("license")) text += " (" + text_of(photograph["license"]) + ")";
    print_line(out, beside, text);
    beside.clear();
  }
}

void print_nodes(std::ostream& out, const ordered_json& nodes) {
  std::size_t width = 4;
  for (const ordered_json& node : nodes)
    width = std::max(width, node["name"].get_ref<const std::string&>().size());
  const auto row = [&](const auto& name, const auto& op, const auto& level, const auto& channels,
                       const auto& region, const std::string& inputs) {
    out << "  " << std::left << std::setw(static_cast<int>(width)) << name << "  " << std::setw(16)
        << op << std::right << std::setw(5) << level << std::setw(10) << channels << std::setw(8)
        << region << "  " << inputs << '\n';
  };
  out << "\n  Receptive field of one voxel in each node, at most, along each axis:\n";
  row("node", "op", "level", "channels", "voxels", "inputs");
  for (const ordered_json& node : nodes) {
    const ordered_json& region = node["voxel_region"];
    row(text_of(node["name"]), text_of(node["op"]), text_of(node["level"]),
        text_of(node["channels"]), region[1].get<int>() - region[0].get<int>() + 1,
        join(node["inputs"]));
  }
}

}  // namespace

std::string to_text(const ordered_json& value, int indent) {
  return value.dump(indent, ' ', false, ordered_json::error_handler_t::replace);
}

ordered_json describe(const solidtex::texture& texture) {
  const auto document = ordered_json::parse(texture.metadata_json());
  const std::string family = document.at("family");
  ordered_json report = {{"file", texture.path()},
                         {"version", document.at("version")},
                         {"name", texture.name()},
                         {"family", family},
                         {"parameters", texture.parameter_count()},
                         {"channels", document.at("channels")},
                         {"color_space", texture.color_space()},
                         {"noise_scheme", document.at("noise").at("scheme")}};
  for (const char* key : {"license", "exemplar", "training"})
    if (document.contains(key)) report[key] = document[key];
  if (family == "field")
    report["nodes"] = describe_nodes(document.at("field"));
  else
    report["sampler"] = document.at("sampler");
  report["voxel"] = {
      {"position", {0, 0, 0}}, {"seed", texture.seed()}, {"values", evaluate_voxel(texture)}};
  report["verified"] = true;
  return report;
}

ordered_json describe(const solidtex::space& space) {
  const auto document = ordered_json::parse(space.metadata_json());
  ordered_json report = {{"file", space.path()},
                         {"sha256", space.sha256()},
                         {"version", document.at("version")},
                         {"name", space.name()},
                         {"family", document.at("family")},
                         {"channels", document.at("channels")},
                         {"color_space", document.at("color_space")}};
  for (const char* key : {"colors", "directions", "patch", "resolution", "code", "license",
                          "training", "lattice", "sampler", "photographs"})
    if (document.contains(key)) report[key] = document[key];
  report["verified"] = true;
  if (space.family() == SOLIDTEX_FAMILY_NONE) return report;
  const solidtex::texture first = space.open(space.photograph(0));
  report["parameters"] = first.parameter_count();
  report["noise_scheme"] = document.at("noise").at("scheme");
  report["voxel"] = {
      {"position", {0, 0, 0}}, {"seed", first.seed()}, {"values", evaluate_voxel(first)}};
  return report;
}

void print(const ordered_json& report, std::ostream& out, bool is_verbose) {
  out << text_of(report["name"]) << '\n';
  print_line(out, "file", text_of(report["file"]));
  // Files call the lattice family "field".
  const std::string family = report.contains("nodes") ? "lattice" : text_of(report["family"]);
  print_line(out, "family", family + ", format version " + text_of(report["version"]));
  if (report.contains("parameters")) print_line(out, "parameters", text_of(report["parameters"]));
  print_line(out, "channels", join(report["channels"]));
  print_line(out, "color space", text_of(report["color_space"]));
  if (report.contains("noise_scheme")) print_line(out, "noise", text_of(report["noise_scheme"]));
  print_line(out, "licence", license_of(report));
  if (report.contains("exemplar")) print_exemplar(out, report["exemplar"]);
  if (report.contains("training")) {
    is_verbose ? print_object(out, "training", report["training"])
               : print_training(out, report["training"]);
  }
  if (report.contains("sampler")) print_object(out, "sampler", report["sampler"]);
  if (report.contains("nodes")) {
    is_verbose ? print_nodes(out, report["nodes"])
               : print_line(out, "layers",
                            std::to_string(report["nodes"].size()) + "; --verbose lists them");
  }
  if (report.contains("photographs")) print_space(out, report);
  out << "\nThe structure is valid.";
  if (!report.contains("voxel")) {
    out << " It is an encoder alone: it finds textures, and makes no models.\n";
    return;
  }
  out << " Voxel (0, 0, 0) of seed " << text_of(report["voxel"]["seed"]) << ":";
  for (const ordered_json& value : report["voxel"]["values"]) out << ' ' << value.get<float>();
  out << '\n';
}

}  // namespace solidtex::tools
