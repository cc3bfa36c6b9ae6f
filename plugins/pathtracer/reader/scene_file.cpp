#include "plugins/pathtracer/reader/scene_file.h"

#include <fstream>
#include <set>

#include "plugins/pathtracer/reader/scene_transform.h"
#include "plugins/pathtracer/reader/schema.h"

namespace solidtex::pathtracer {
namespace {

using nlohmann::json;

constexpr int kMaxDepth = 32;  // far more than the schema allows, far less than the stack does

json parse_file(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream || std::filesystem::is_directory(file)) {
    throw SceneError(file.string() + ": found no readable file, expected a scene");
  }
  // nlohmann-json keeps the last of two equal keys; a scene must not lose the first one silently.
  std::vector<std::set<std::string>> open_objects;
  const auto check_structure = [&](int depth, json::parse_event_t event, json& value) {
    if (depth > kMaxDepth) {
      throw SceneError(file.string() + ": found more than " + std::to_string(kMaxDepth) +
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
    throw SceneError(file.string() + ": found what is not JSON (" + error.what() +
                     "), expected a scene");
  }
}

}  // namespace

SceneFile::SceneFile(const std::filesystem::path& file)
    : SceneFile(file, parse_file(file), file.string()) {}

SceneFile::SceneFile(const std::filesystem::path& file, json document, std::string label)
    : file_(file), document_(std::move(document)), label_(std::move(label)) {
  check_scene_schema(document_, label_);
}

std::filesystem::path SceneFile::beside(const Place& place) const {
  return file_.parent_path() / at(place).get<std::string>();
}

glm::dmat4 SceneFile::transform(const Place& place) const {
  return read_transform(document_, place, label_);
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
