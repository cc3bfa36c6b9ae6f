#include "plugins/pathtracer/reader/animation.h"

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <solidtex/pathtracer.hpp>

#include "plugins/pathtracer/reader/scene_file.h"
#include "plugins/pathtracer/reader/schema.h"

namespace solidtex::pathtracer {
namespace {

using nlohmann::json;

using Keys = std::map<int, const json*>;  // by frame; JSON orders them as text

Keys keys_of(const json& track) {
  Keys keys;
  for (const auto& [frame, value] : track.items()) keys[std::stoi(frame)] = &value;
  return keys;
}

// Whether both are numbers, or arrays of the same shape.
bool has_same_shape(const json& a, const json& b) {
  if (a.is_number() && b.is_number()) return true;
  if (!a.is_array() || !b.is_array() || a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!has_same_shape(a[i], b[i])) return false;
  }
  return true;
}

// Returns the value that a track animates, or null.
const json* find_value(const json& document, const std::string& name) {
  try {
    return &document.at(Place(name));
  } catch (const json::exception&) {
    return nullptr;
  }
}

// Sums weight times value, element by element.
json weighted_sum(const std::vector<std::pair<double, const json*>>& terms) {
  if (terms.front().second->is_number()) {
    double sum = 0;
    for (const auto& [weight, value] : terms) sum += weight * value->get<double>();
    return sum;
  }
  json result = json::array();
  for (std::size_t i = 0; i < terms.front().second->size(); ++i) {
    auto elements = terms;
    for (auto& [weight, value] : elements) value = &(*value)[i];
    result.push_back(weighted_sum(elements));
  }
  return result;
}

// Catmull-Rom interpolation of non-uniform keys (Catmull and Rom, "A class of local interpolating
// splines", 1974): at each key the derivative is that of the neighbors' chord, at the ends of the
// track that of the segment. The value is constant before the first and after the last key.
json value_at(const Keys& keys, double frame) {
  const auto after = keys.lower_bound(static_cast<int>(std::ceil(frame)));
  if (after == keys.begin()) return *after->second;
  if (after == keys.end()) return *keys.rbegin()->second;
  if (after->first == frame) return *after->second;
  const auto before = std::prev(after);
  const auto first = before == keys.begin() ? before : std::prev(before);
  const auto last = std::next(after) == keys.end() ? after : std::next(after);

  const double length = after->first - before->first;
  const double t = (frame - before->first) / length;
  // Hermite weights of the derivatives, times segment length over chord length.
  const double start = t * (1 - t) * (1 - t) * length / (after->first - first->first);
  const double end = t * t * (t - 1) * length / (last->first - before->first);
  const double to_after = t * t * (3 - 2 * t);
  return weighted_sum({{1 - to_after - end, before->second},
                       {to_after + start, after->second},
                       {-start, first->second},
                       {end, last->second}});
}

}  // namespace

void check_animation(const json& document, const std::string& file) {
  if (!document.contains("animation")) return;
  const json& animation = document["animation"];
  const int frames = animation["frames"];
  for (const auto& [name, track] : animation["tracks"].items()) {
    const Place place = Place("/animation/tracks") / name;
    const json* animated = name.empty() ? nullptr : find_value(document, name);
    if (!animated) {
      refuse_json(file, place, "the track of \"" + name + "\"",
                  "the place of a value in this file, \"/camera/position\" say");
    }
    for (const auto& [frame, value] : track.items()) {
      if (std::stoi(frame) >= frames) {
        refuse_json(file, place / frame, "frame " + frame,
                    "one from 0 to " + std::to_string(frames - 1));
      }
      if (!has_same_shape(value, *animated)) {
        refuse_json(file, place / frame, quote_json(value),
                    "numbers in the form of " + quote_json(*animated));
      }
    }
  }
}

json document_at(const json& document, double frame) {
  if (!document.contains("animation")) return document;
  json result = document;
  for (const auto& [name, track] : document["animation"]["tracks"].items()) {
    result[Place(name)] = value_at(keys_of(track), frame);
  }
  return result;
}

json with_turned_camera(const json& document, double degrees, const glm::dvec3& origin) {
  json result = document;
  json& camera = result["camera"];
  const auto position_of = [&](const char* key) {
    return origin + glm::dvec3(glm::vec3(to_dvec3(camera[key]) - origin));
  };
  const glm::dvec3 center = position_of("look_at");
  const glm::dvec3 up(to_vec3(camera.value("up", json{0, 1, 0})));
  const glm::dmat4 turn = glm::rotate(glm::dmat4(1), glm::radians(degrees), up);
  const glm::dvec3 position = center + glm::dmat3(turn) * (position_of("position") - center);
  camera["position"] = {position.x, position.y, position.z};
  return result;
}

}  // namespace solidtex::pathtracer
