#include "plugins/pathtracer/reader/color_layer.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <optional>
#include <set>
#include <solidtex/pathtracer.hpp>

namespace solidtex::pathtracer {
namespace {

constexpr int kNoChannel = -1;

// Smaller is better.
enum class Rank { plain, color_name, other_name, data_pass };

struct Candidate {
  std::string name;  // part and layer; empty for plain channels of a single part
  ColorLayer layer;
  Rank rank = Rank::plain;
};

std::string to_lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

// The words of a layer's name: letters only, in lower case.
std::vector<std::string> words_of(const std::string& name) {
  std::vector<std::string> words(1);
  for (const char c : to_lower(name)) {
    if (std::isalpha(static_cast<unsigned char>(c))) {
      words.back() += c;
    } else if (!words.back().empty()) {
      words.emplace_back();
    }
  }
  if (words.back().empty()) words.pop_back();
  return words;
}

Rank rank_of(const std::string& name) {
  static const std::set<std::string> colors = {"beauty", "combined",  "rgb",   "rgba", "color",
                                               "color",  "composite", "final", "image"};
  static const std::set<std::string> data = {"ao",       "occlusion", "ambientocclusion",
                                             "normal",   "normals",   "n",
                                             "depth",    "z",         "position",
                                             "p",        "pworld",    "uv",
                                             "st",       "vector",    "velocity",
                                             "motion",   "mist",      "shadow",
                                             "mask",     "matte",     "id",
                                             "variance", "texcoord",  "cost",
                                             "samples",  "footprint"};
  const std::vector<std::string> words = words_of(name);
  if (words.empty()) return Rank::plain;
  if (words.front().starts_with("crypto") || words.front().starts_with("ucrypto")) {
    return Rank::data_pass;
  }
  const bool is_data = std::ranges::any_of(words, [](const auto& w) { return data.contains(w); });
  if (is_data) return Rank::data_pass;
  return colors.contains(words.back()) ? Rank::color_name : Rank::other_name;
}

// Index of a color component in a pixel, or kNoChannel.
int component_of(const std::string& channel) {
  static const std::map<std::string, int> names = {{"r", 0},     {"red", 0}, {"g", 1},
                                                   {"green", 1}, {"b", 2},   {"blue", 2}};
  const auto found = names.find(to_lower(channel));
  return found == names.end() ? kNoChannel : found->second;
}

// Beside X, Y is a coordinate; beside RY and BY it needs their chroma.
bool is_not_luminance(const std::string& other) {
  return other == "x" || other == "ry" || other == "by";
}

struct LayerChannels {
  std::array<int, 3> color{kNoChannel, kNoChannel, kNoChannel};
  int luminance = kNoChannel;
  bool has_luminance_only = true;
};

// Groups the channels of a part by the layer in their names.
std::map<std::string, LayerChannels> group_channels(const OIIO::ImageSpec& spec) {
  std::map<std::string, LayerChannels> layers;
  for (int c = 0; c < spec.nchannels; ++c) {
    const std::string& name = spec.channelnames[static_cast<std::size_t>(c)];
    const std::size_t dot = name.rfind('.');
    const std::string channel = dot == std::string::npos ? name : name.substr(dot + 1);
    LayerChannels& layer = layers[dot == std::string::npos ? "" : name.substr(0, dot)];
    if (const int component = component_of(channel); component != kNoChannel) {
      layer.color[static_cast<std::size_t>(component)] = c;
    } else if (to_lower(channel) == "y") {
      layer.luminance = c;
    } else if (is_not_luminance(to_lower(channel))) {
      layer.has_luminance_only = false;
    }
  }
  return layers;
}

std::optional<std::array<int, 3>> color_channels(const LayerChannels& layer) {
  if (std::ranges::count(layer.color, kNoChannel) == 0) return layer.color;
  const bool has_color = std::ranges::count(layer.color, kNoChannel) < 3;
  if (layer.luminance == kNoChannel || !layer.has_luminance_only || has_color) return std::nullopt;
  return std::array<int, 3>{layer.luminance, layer.luminance, layer.luminance};
}

std::string join(const std::string& part, const std::string& layer) {
  if (part.empty() || layer == part || layer.starts_with(part + ".")) return layer;
  return layer.empty() ? part : part + "." + layer;
}

std::string list(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::vector<ColorLayer> read_parts(OIIO::ImageInput& input) {
  std::vector<ColorLayer> parts;
  for (int part = 0; input.seek_subimage(part, 0); ++part) parts.push_back({input.spec(), part});
  return parts;
}

// All layers of an EXR, with those that have color as candidates.
struct Layers {
  std::vector<std::string> names;
  std::vector<Candidate> candidates;
};

Layers find_layers(const std::vector<ColorLayer>& parts) {
  Layers result;
  for (const ColorLayer& part : parts) {
    const std::string part_name =
        parts.size() > 1 ? part.spec.get_string_attribute("oiio:subimagename") : "";
    for (const auto& [layer_name, channels] : group_channels(part.spec)) {
      Candidate candidate{join(part_name, layer_name), part, Rank::plain};
      result.names.push_back(candidate.name.empty() ? "(unnamed)" : candidate.name);
      const auto color = color_channels(channels);
      if (!color) continue;
      candidate.rank = rank_of(candidate.name);
      candidate.layer.channels = *color;
      result.candidates.push_back(std::move(candidate));
    }
  }
  return result;
}

[[noreturn]] void refuse_layers(const std::filesystem::path& file, const Layers& layers,
                                const std::vector<ColorLayer>& parts) {
  if (layers.names.size() == 1) {
    throw SceneError(file.string() + ": found the channels " + list(parts[0].spec.channelnames) +
                     ", expected R, G, B or Y");
  }
  throw SceneError(
      file.string() + ": found the layers " + list(layers.names) +
      ", expected one with the color, as R, G, B or named Beauty, Combined or rgb (select it: "
      "oiiotool IN.exr --ch LAYER.R,LAYER.G,LAYER.B --chnames R,G,B -o OUT.exr)");
}

ColorLayer find_exr_layer(const std::vector<ColorLayer>& parts, const std::filesystem::path& file,
                          std::vector<std::string>& notes) {
  const Layers layers = find_layers(parts);
  const auto best = std::ranges::min_element(layers.candidates, {}, &Candidate::rank);
  if (best == layers.candidates.end() || best->rank == Rank::data_pass ||
      std::ranges::count(layers.candidates, best->rank, &Candidate::rank) > 1) {
    refuse_layers(file, layers, parts);
  }
  if (best->rank != Rank::plain) {
    notes.push_back(file.filename().string() + ": the color is the layer " + best->name + " of " +
                    list(layers.names));
  }
  return best->layer;
}

ColorLayer find_largest_page(const std::vector<ColorLayer>& parts,
                             const std::filesystem::path& file, std::vector<std::string>& notes) {
  ColorLayer page = *std::ranges::max_element(
      parts, {}, [](const ColorLayer& part) { return part.spec.image_pixels(); });
  if (parts.size() > 1) {
    notes.push_back(file.filename().string() + ": the color is page " +
                    std::to_string(page.part + 1) + " of " + std::to_string(parts.size()));
  }
  if (page.spec.nchannels >= 3) page.channels = {0, 1, 2};  // else gray, with or without alpha
  return page;
}

}  // namespace

ColorLayer find_color_layer(OIIO::ImageInput& input, const std::filesystem::path& file,
                            std::vector<std::string>& notes) {
  const std::vector<ColorLayer> parts = read_parts(input);
  if (parts.empty()) throw SceneError(file.string() + ": found no pixels, expected an image");
  return input.format_name() == std::string("openexr") ? find_exr_layer(parts, file, notes)
                                                       : find_largest_page(parts, file, notes);
}

}  // namespace solidtex::pathtracer
