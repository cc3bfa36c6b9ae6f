#include "plugins/pathtracer/reader/scene_transform.h"

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "plugins/pathtracer/reader/schema.h"

namespace solidtex::pathtracer {
namespace {

using nlohmann::json;
using Pointer = json::json_pointer;

glm::dmat4 rotation(const json& rotate, const Pointer& place, const std::string& file) {
  const glm::dvec3 axis = to_dvec3(rotate["axis"]);
  if (glm::length(axis) == 0) {
    refuse_json(file, place / "rotate" / "axis", quote_json(rotate["axis"]), "a direction");
  }
  return glm::rotate(glm::dmat4(1), glm::radians(rotate["degrees"].get<double>()),
                     glm::normalize(axis));
}

glm::dmat4 read_step(const json& step, const Pointer& place, const std::string& file) {
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

glm::dmat4 read_transform(const json& document, const Pointer& place, const std::string& file) {
  glm::dmat4 result(1);
  for (std::size_t i = 0; i < document.at(place).size(); ++i) {
    result = read_step(document.at(place / i), place / i, file) * result;
  }
  const double volume = std::abs(glm::determinant(glm::dmat3(result)));
  if (!(volume > 1e-30) || !std::isfinite(volume)) {
    refuse_json(file, place, "a transform that flattens space", "one that can be undone");
  }
  return result;
}

}  // namespace solidtex::pathtracer
