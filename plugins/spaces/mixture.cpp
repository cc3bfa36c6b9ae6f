#include "plugins/spaces/mixture.h"

#include <algorithm>
#include <cmath>

#include "plugins/common/near_name.h"

namespace solidtex::spaces {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kShownPhotographs = 12, kShownDigits = 12;
constexpr char kOneSpace[] = ": materials of different spaces cannot be mixed";

[[noreturn]] void refuse(const std::string& input, const std::string& found,
                         const std::string& expected) {
  throw MixtureError(input + ": found " + found + ", expected " + expected);
}

ordered_json document_of(const std::string& model) {
  return ordered_json::parse(solidtex::texture(model).metadata_json());
}

// Returns training.space of a model's document, or null.
ordered_json recorded_space(const ordered_json& document) {
  const auto training = document.find("training");
  if (training == document.end() || !training->is_object()) return nullptr;
  const ordered_json space = training->value("space", ordered_json());
  return space.is_object() ? space : ordered_json();
}

std::string text_at(const ordered_json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

// Refuses a model without a code that describes it.
void check_code(const std::string& input, const ordered_json& document) {
  if (recorded_space(document).is_null()) {
    refuse(input, "a model of no texture space",
           "a model from solidtex-encode or solidtex-mix, or a training photograph of a space, "
           "SPACE:PHOTOGRAPH");
  }
  if (!has_code(document)) {
    refuse(input, "a model that was fine-tuned, which no code of its space describes",
           "a model as solidtex-encode writes it");
  }
}

std::vector<float> numbers(const std::string& input, const std::string& field,
                           const ordered_json& values, std::size_t count) {
  std::vector<float> result;
  for (const ordered_json& value : values) {
    if (value.is_number()) result.push_back(value.get<float>());
  }
  if (values.is_array() && values.size() == count && result.size() == count) return result;
  refuse(input + ": training.space." + field,
         values.is_array() ? std::to_string(values.size()) + " values" : "no array",
         std::to_string(count) + " numbers");
}

std::size_t find_photograph(const solidtex::space& space, const std::string& given,
                            const std::string& photograph) {
  const std::size_t count = space.photograph_count();
  std::vector<std::string> names;
  for (std::size_t i = 0; i < count; ++i) {
    names.push_back(space.photograph_name(i));
    if (names.back() == photograph) return i;
  }
  if (const auto near = near_names(photograph, names); !near.empty()) names = near;
  if (names.size() > kShownPhotographs) names.resize(kShownPhotographs);
  std::string shown;
  for (const std::string& name : names) shown += (shown.empty() ? "" : ", ") + name;
  if (names.size() < count) shown += ", ...";
  refuse(given, "\"" + photograph + "\"",
         "one of the " + std::to_string(count) + " training photographs of " + space.path() + " (" +
             shown + "; solidtex-info " + space.path() + " lists them)");
}

// Returns the photographs of a model, or of the inputs of a mixture.
ordered_json exemplars_of(const ordered_json& document) {
  ordered_json result = ordered_json::array();
  const auto add = [&](const ordered_json& exemplar) {
    if (std::ranges::find(result, exemplar) == result.end()) result.push_back(exemplar);
  };
  const ordered_json own = document.value("exemplar", ordered_json());
  if (own.is_object()) add(own);
  if (own.is_array()) std::ranges::for_each(own, add);
  for (const ordered_json& input : document["training"].value("mix", ordered_json::array())) {
    if (!input.is_object()) continue;
    std::ranges::for_each(input.value("exemplars", ordered_json::array()), add);
  }
  return result;
}

std::string space_of(const std::vector<std::string>& names) {
  const Name name = split_name(names.front());
  if (!name.space.empty()) return name.space;
  const ordered_json document = document_of(names.front());
  check_code(names.front(), document);
  return text_at(recorded_space(document), "name");
}

solidtex::space open_space(const std::vector<std::string>& names, const std::string& given) {
  if (names.size() < 2) throw MixtureError("found one material, expected two or more to mix");
  if (!given.empty()) return solidtex::space(given);
  std::string space;
  try {
    space = space_of(names);
    return solidtex::space(space);
  } catch (const solidtex::error& error) {
    const std::string reason = error.what();
    const bool names_file =
        reason.starts_with(names.front() + ":") || reason.starts_with(space + ":");
    throw MixtureError(names_file ? reason : names.front() + ": " + reason);
  }
}

}  // namespace

Name split_name(const std::string& name) {
  const std::size_t colon = name.rfind(':');
  if (colon == std::string::npos || name.ends_with(".solidtex")) return {};
  return {name.substr(0, colon), name.substr(colon + 1)};
}

bool has_code(const ordered_json& document) {
  return !recorded_space(document).is_null() && !document["training"].contains("fine_tuned");
}

solidtex::texture open_material(const std::string& name, const solidtex::options& options) {
  const Name parts = split_name(name);
  if (parts.space.empty()) return solidtex::texture(name, options);
  const solidtex::space space(parts.space);
  return space.open(space.photograph(find_photograph(space, name, parts.photograph)), "", options);
}

Mixture::Mixture(const std::vector<std::string>& names, const std::string& space,
                 const std::string& option)
    : space_(open_space(names, space)),
      wanted_("the space of " + (space.empty() ? names.front() : option)) {
  for (const std::string& given : names) {
    const Name name = split_name(given);
    if (name.space.empty()) {
      inputs_.push_back(model(given, document_of(given)));
      continue;
    }
    if (name.space != space_.name() && name.space != space_.path() &&
        solidtex::space(name.space).sha256() != space_.sha256()) {
      refuse(given, "a photograph of the space " + name.space,
             wanted_ + ", " + shown_space() + kOneSpace);
    }
    inputs_.push_back(photograph(given, name.photograph));
  }
}

Mixture::Input Mixture::photograph(const std::string& given, const std::string& photograph) const {
  const std::size_t index = find_photograph(space_, given, photograph);
  const ordered_json record = ordered_json::parse(space_.metadata_json())["photographs"][index];
  Input input{space_.name() + ":" + photograph, space_.photograph(index)};
  input.license = text_at(record, "license");
  ordered_json exemplar = {{"file", photograph}};
  for (const char* key : {"sha256", "license", "source"}) {
    if (const std::string text = text_at(record, key); !text.empty()) exemplar[key] = text;
  }
  input.exemplars.push_back(exemplar);
  return input;
}

void Mixture::check_space(const std::string& given, const ordered_json& recorded) const {
  const std::string name = text_at(recorded, "name"), hash = text_at(recorded, "sha256");
  if (hash == space_.sha256()) return;
  const std::string found = "a model of ";
  const std::string version = " (SHA-256 " + hash.substr(0, kShownDigits) + "...)";
  if (name == space_.name()) {
    refuse(given, found + "another version of the space " + name + version,
           "the version in " + shown_space() +
               ": encode its photograph again, or name the file of its "
               "space");
  }
  refuse(given, found + "the space " + name + version, wanted_ + ", " + shown_space() + kOneSpace);
}

std::string Mixture::shown_space() const {
  return space_.path() + " (" + space_.sha256().substr(0, kShownDigits) + "...)";
}

Mixture::Input Mixture::model(const std::string& given, const ordered_json& document) const {
  check_code(given, document);
  const ordered_json recorded = recorded_space(document);
  check_space(given, recorded);
  Input input{text_at(document, "name"),
              {numbers(given, "code", recorded.value("code", ordered_json()), space_.code_size())}};
  if (space_.has_colors()) {
    const ordered_json rows = recorded.value("colors", ordered_json::array());
    for (std::size_t row = 0; row < 3; ++row) {
      const ordered_json values = rows.is_array() && row < rows.size() ? rows[row] : ordered_json();
      const std::vector<float> found = numbers(given, "colors." + std::to_string(row), values, 4);
      input.material.colors.insert(input.material.colors.end(), found.begin(), found.end());
    }
  }
  input.exemplars = exemplars_of(document);
  const bool is_of_space = recorded.contains("license");
  if (!is_of_space) input.license = text_at(document, "license");
  return input;
}

solidtex::material Mixture::blend(std::span<const double> weights) const {
  std::vector<solidtex::material> materials;
  std::vector<double> positive;
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    if (weights[i] <= 0) continue;
    materials.push_back(inputs_[i].material);
    positive.push_back(weights[i]);
  }
  return materials.size() == 1 ? materials.front() : space_.blend(materials, positive);
}

std::string Mixture::details(const std::string& model_name, std::span<const double> weights) const {
  ordered_json mix = ordered_json::array();
  std::vector<std::string> licenses;
  double sum = 0;
  for (const double weight : weights) sum += weight;
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    if (weights[i] <= 0) continue;
    const Input& input = inputs_[i];
    mix.push_back(
        {{"name", input.name}, {"weight", weights[i] / sum}, {"exemplars", input.exemplars}});
    if (!input.license.empty() && std::ranges::find(licenses, input.license) == licenses.end()) {
      licenses.push_back(input.license);
    }
  }
  ordered_json details = {{"name", model_name}, {"training", {{"mix", mix}}}};
  std::string license;
  for (const std::string& one : licenses) license += (license.empty() ? "" : ", ") + one;
  if (!license.empty()) details["license"] = license;
  return details.dump();
}

std::vector<double> weights_at(double position, std::size_t count) {
  std::vector<double> weights(count);
  const double steps = static_cast<double>(count - 1);
  const double place = std::clamp(position, 0.0, 1.0) * steps;
  const double before = std::min(std::floor(place), steps - 1);
  weights[static_cast<std::size_t>(before)] = 1 - (place - before);
  weights[static_cast<std::size_t>(before) + 1] = place - before;
  return weights;
}

}  // namespace solidtex::spaces
