// A scene file as JSON that satisfies the schema, with accessors and errors that name a place in
// it.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <nlohmann/json.hpp>
#include <solidtex/pathtracer.hpp>
#include <string>
#include <vector>

namespace solidtex::pathtracer {

using Place = nlohmann::json::json_pointer;

glm::dvec3 to_dvec3(const nlohmann::json& value);
glm::vec3 to_vec3(const nlohmann::json& value);

// One factor for all axes, or three.
glm::dvec3 to_scale(const nlohmann::json& value);

class SceneFile {
 public:
  // Throws SceneError if the file is not readable, not JSON, or violates the schema.
  explicit SceneFile(const std::filesystem::path& file);
  // Replaces the file's content by another document, which is checked, too. Errors call it `label`.
  SceneFile(const std::filesystem::path& file, nlohmann::json document, std::string label);

  const nlohmann::json& document() const { return document_; }
  const std::filesystem::path& path() const { return file_; }

  const nlohmann::json& at(const Place& place) const { return document_.at(place); }
  bool has(const char* key) const { return document_.contains(key); }

  // Resolves the file name at this place relative to the scene's folder.
  std::filesystem::path resolve(const Place& place) const;

  // Composes the transform steps at this place, in order; the identity if there is no such place.
  // Throws SceneError for a singular transform and for a rotation axis of length zero.
  glm::dmat4 transform(const Place& place) const;

  // Throws SceneError if the object at this place, described by `owner`, lacks a required key or
  // has a key that is neither required nor optional.
  using Keys = std::vector<std::string>;
  void check_keys(const Place& place, const std::string& owner, const Keys& required,
                  const Keys& optional) const;

  [[noreturn]] void refuse(const Place& place, const std::string& found,
                           const std::string& expected) const;

  // Calls load_file(). Adds the scene file and the place to its errors, which name the loaded file.
  template <class Load>
  auto load(const Place& place, Load load_file) const {
    try {
      return load_file();
    } catch (const std::exception& error) {
      throw SceneError(label_ + ": " + place.to_string() + ": " + error.what());
    }
  }

 private:
  std::filesystem::path file_;
  nlohmann::json document_;
  std::string label_;
};

}  // namespace solidtex::pathtracer
