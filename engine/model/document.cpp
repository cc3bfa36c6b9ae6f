// The part of a model's document that all families share.
#include <algorithm>

#include "engine/model/readers.h"

namespace solidtex::engine {
namespace {

constexpr std::int64_t version = 1;
constexpr std::size_t max_output_channels = 64, max_exemplars = 3;

std::vector<std::string> read_channels(const Fields& document) {
  std::vector<std::string> channels;
  for (const auto& name : document.array("channels", 1, max_output_channels)) {
    const std::string where = "channels[" + std::to_string(channels.size()) + "]";
    check_name(document.label(), where, name);
    const auto& text = name.get_ref<const std::string&>();
    if (std::ranges::find(channels, text) != channels.end())
      throw invalid(document.label(), where, show(name), "a name that no earlier channel has");
    channels.push_back(text);
  }
  return channels;
}

bool is_sha256(const std::string& text) {
  const auto is_digit = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
  return text.size() == 64 && std::ranges::all_of(text, is_digit);
}

void check_exemplar(const Fields& exemplar) {
  exemplar.allow_only({"file", "sha256", "license", "source"});
  for (const char* key : {"file", "sha256", "license", "source"})
    if (exemplar.contains(key)) exemplar.string(key);
  if (exemplar.contains("sha256") && !is_sha256(exemplar.string("sha256")))
    throw exemplar.wrong("sha256", "64 lower-case hexadecimal digits");
}

// Checks the optional exemplar and license.
void check_provenance(const Fields& document) {
  if (document.contains("license")) document.string("license");
  if (document.contains("training")) document.child("training");
  if (!document.contains("exemplar")) return;
  if (!document.value("exemplar").is_array()) return check_exemplar(document.child("exemplar"));
  std::size_t index = 0;
  for (const auto& value : document.array("exemplar", 1, max_exemplars))
    check_exemplar(Fields(document.label(), "exemplar[" + std::to_string(index++) + "]", value));
}

NoiseScheme read_noise_scheme(const Fields& noise) {
  noise.allow_only({"scheme"});
  return noise.choice("scheme", {"solidtex-1", "solidtexturenets"}) == "solidtex-1"
             ? NoiseScheme::solidtex_1
             : NoiseScheme::solidtexturenets;
}

}  // namespace

void read_document(const Fields& document, Model& model) {
  document.integer("version", version, version);
  document.allow_only({"version", "name", "family", "channels", "color_space", "noise", "field",
                       "sampler", "exemplar", "training", "license"});
  model.name = document.name("name");
  model.color_space = document.choice("color_space", {"srgb", "linear", "data"});
  check_provenance(document);
  model.channels = read_channels(document);
  model.noise_scheme = read_noise_scheme(document.child("noise"));
}

}  // namespace solidtex::engine
