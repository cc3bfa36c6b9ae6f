// A scene file as the readers of its parts see it: JSON that the schema has accepted, places in it,
// and messages that name them.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <nlohmann/json.hpp>
#include <solidtex/pathtracer.hpp>
#include <string>
#include <vector>

namespace solidtex::pathtracer {

using Place = nlohmann::json::json_pointer;

class SceneFile {
 public:
  // Throws SceneError for what is not readable, not JSON, or breaks the schema.
  explicit SceneFile(const std::filesystem::path& file);
  // What the file would say: another document, checked too, in the file's place. `label` stands
  // for it in messages.
  SceneFile(const std::filesystem::path& file, nlohmann::json document, std::string label);

  const nlohmann::json& document() const { return document_; }
  const std::filesystem::path& path() const { return file_; }

  const nlohmann::json& at(const Place& place) const { return document_.at(place); }
  bool has(const char* key) const { return document_.contains(key); }

  // The file that is named at this place, relative to the scene's folder.
  std::filesystem::path beside(const Place& place) const;

  // The steps of a transform at this place. Throws SceneError as read_transform.
  glm::dmat4 transform(const Place& place) const;

  // Throws SceneError when the object at this place, described by `owner`, has not all of the keys
  // `required`, or one that is neither among them nor `optional`.
  using Keys = std::vector<std::string>;
  void check_keys(const Place& place, const std::string& owner, const Keys& required,
                  const Keys& optional) const;

  [[noreturn]] void refuse(const Place& place, const std::string& found,
                           const std::string& expected) const;

  // Loading errors name the file they are about; this adds who asked for it.
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
