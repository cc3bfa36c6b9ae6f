#include "plugins/pathtracer/reader/scene_file.h"

#include <cmath>
#include <fstream>
#include <glm/gtc/matrix_transform.hpp>
#include <set>

#include "plugins/pathtracer/reader/schema.h"

namespace solidtex::pathtracer {
namespace {

using nlohmann::json;

constexpr int kMaxNesting = 32;  // above the schema's maximum, below what the stack allows

json parse_file(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream || std::filesystem::is_directory(file)) {
    throw SceneError(file.string() + ": found no readable file, expected a scene");
  }
  // Refuses duplicate keys, of which nlohmann-json would keep the last.
  std::vector<std::set<std::string>> open_objects;
  const auto check_structure = [&](int depth, json::parse_event_t event, json& value) {
    if (depth > kMaxNesting) {
      throw SceneError(file.string() + ": found more than " + std::to_string(kMaxNesting) +
                       " nested values, expected a scene");
    }
    if (event == json::parse_event_t::object_start) open_objects.emplace_back();
    if (event == json::parse_event_t::object_end) open_objects.pop_back();
    if (event == json::parse_event_t::key && !open_objects.back().insert(value).second) {
      throw SceneError(file.string() + ": found the key " + value.dump() +
                       " twice in one object, expected it once");
    }
    return true;
  };
  try {
    return json::parse(stream, check_structure);
  } catch (const json::exception& error) {
    const std::string reason = error.what();  // begins "[json.exception.parse_error.101] "
    throw SceneError(file.string() + ": found what is not JSON (" +
                     reason.substr(reason.find("] ") + 2) + "), expected a scene");
  }
}

glm::dmat4 rotation(const json& rotate, const Place& place, const std::string& file) {
  const glm::dvec3 axis = to_dvec3(rotate["axis"]);
  if (glm::length(axis) == 0) {
    refuse_json(file, place / "rotate" / "axis", quote_json(rotate["axis"]), "a direction");
  }
  return glm::rotate(glm::dmat4(1), glm::radians(rotate["degrees"].get<double>()),
                     glm::normalize(axis));
}

glm::dmat4 read_step(const json& step, const Place& place, const std::string& file) {
  const glm::dmat4 identity(1);
  if (step.contains("scale")) return glm::scale(identity, to_scale(step["scale"]));
  if (step.contains("translate")) return glm::translate(identity, to_dvec3(step["translate"]));
  if (step.contains("rotate")) return rotation(step["rotate"], place, file);
  glm::dmat4 matrix(1);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      matrix[column][row] =
          step["matrix"][static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
    }
  }
  return matrix;
}

}  // namespace

glm::dvec3 to_dvec3(const json& value) { return {value[0], value[1], value[2]}; }
glm::vec3 to_vec3(const json& value) { return glm::vec3(to_dvec3(value)); }

glm::dvec3 to_scale(const json& value) {
  return value.is_number() ? glm::dvec3(value.get<double>()) : to_dvec3(value);
}

SceneFile::SceneFile(const std::filesystem::path& file)
    : SceneFile(file, parse_file(file), file.string()) {}

SceneFile::SceneFile(const std::filesystem::path& file, json document, std::string label)
    : file_(file), document_(std::move(document)), label_(std::move(label)) {
  check_scene_schema(document_, label_);
}

std::filesystem::path SceneFile::resolve(const Place& place) const {
  return file_.parent_path() / at(place).get<std::string>();
}

glm::dmat4 SceneFile::transform(const Place& place) const {
  glm::dmat4 result(1);
  if (!document_.contains(place)) return result;
  for (std::size_t i = 0; i < at(place).size(); ++i) {
    result = read_step(at(place / i), place / i, label_) * result;
  }
  const double volume = std::abs(glm::determinant(glm::dmat3(result)));
  if (!(volume > 1e-30) || !std::isfinite(volume)) {
    refuse(place, "a transform that flattens space", "an invertible transform");
  }
  return result;
}

void SceneFile::check_keys(const Place& place, const std::string& owner, const Keys& required,
                           const Keys& optional) const {
  std::set<std::string> known(required.begin(), required.end());
  known.insert(optional.begin(), optional.end());
  std::string names;
  for (const std::string& key : known) names += (names.empty() ? "" : ", ") + key;
  for (const std::string& key : required) {
    if (!at(place).contains(key)) {
      refuse(place, "no key \"" + key + "\"", owner + " with the keys " + names);
    }
  }
  for (const auto& [key, unused] : at(place).items()) {
    if (!known.contains(key)) {
      refuse(place / key, "a key that does not go with " + owner, "one of " + names);
    }
  }
}

void SceneFile::refuse(const Place& place, const std::string& found,
                       const std::string& expected) const {
  refuse_json(label_, place, found, expected);
}

}  // namespace solidtex::pathtracer
