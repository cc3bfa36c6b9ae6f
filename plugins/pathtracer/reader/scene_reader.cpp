// Reads a scene file into a Scene, frame by frame.
#include <cmath>
#include <sstream>
#include <utility>

#include "plugins/pathtracer/reader/animation.h"
#include "plugins/pathtracer/reader/parts.h"
#include "plugins/pathtracer/reader/studio.h"

namespace solidtex::pathtracer {
namespace {

using nlohmann::json;

// Reads the parts that differ from the document `before`, which is null for the first frame. An
// animated camera then reloads no mesh, an animated cut keeps the bricks of textures.
void read_changes(const SceneFile& file, const json& before, Scene& scene) {
  const json& now = file.document();
  scene.notes.clear();
  const auto changed = [&](const char* key) {
    return before.is_null() || before.value(key, json()) != now.value(key, json());
  };
  if (changed("render")) {
    scene.settings = {};
    scene.display = {};
    read_settings(file, scene);
  }
  if (changed("camera")) {
    scene.camera = {};
    read_camera(file, scene);
  }
  const bool materials = changed("materials");
  if (materials) {
    scene.materials.clear();
    scene.images.clear();
    scene.textures.clear();
    read_materials(file, scene);
  }
  const bool objects = materials || changed("objects");
  if (objects) {
    scene.objects.clear();
    scene.meshes.clear();
    scene.materials.resize(now["materials"].size());  // drops copies that were scaled to objects
    read_objects(file, scene);
  }
  if (changed("environment")) {
    scene.environment.reset();
    read_environment(file, scene);
  }
  if (objects || changed("lights")) {
    scene.lights.clear();
    scene.sphere_lights.clear();
    scene.mesh_lights.clear();
    read_lights(file, scene);
  }
  if (scene.objects.empty() && scene.lights.empty() && scene.sphere_lights.empty() &&
      scene.mesh_lights.empty() && !scene.environment) {
    file.refuse(Place(), "an empty scene", "objects, lights or an environment");
  }
  scene.source = now.dump();
}

// Multiple of the camera's distance beyond which render space gets an origin of its own.
constexpr double kFar = 1024;

// Returns the look-at point, rounded, if the camera is far away from zero; otherwise zero.
glm::dvec3 choose_origin(const json& camera) {
  const glm::dvec3 look_at = to_dvec3(camera["look_at"]);
  const double distance = glm::length(look_at - to_dvec3(camera["position"]));
  if (distance == 0 || glm::length(look_at) <= kFar * distance) return glm::dvec3(0);
  const double step = std::exp2(std::ceil(std::log2(distance)));
  return glm::round(look_at / step) * step;
}

}  // namespace

struct Sequence::State {
  explicit State(const SceneFile& given) : file(given) {
    check_animation(file.document(), file.path().string());
    json document = file.document();
    scene.origin = choose_origin(document["camera"]);
    if (!needs_studio(document)) return;
    notes.push_back(file.path().string() + ": no light, lit by the default studio");
    add_studio(document);
    file = SceneFile(file.path(), std::move(document), file.path().string());
  }

  json document_of(int frame) const {
    json document = document_at(file.document(), turntable_frames > 0 ? 0 : frame);
    if (turntable_frames > 0)
      document = with_turned_camera(document, 360.0 * frame / turntable_frames, scene.origin);
    return document;
  }

  SceneFile file;
  int turntable_frames = 0;        // 0: no turntable
  std::vector<std::string> notes;  // of every frame
  json read;                       // the document of `scene`
  Scene scene;
};

Sequence::Sequence(const std::filesystem::path& file)
    : state_(std::make_unique<State>(SceneFile(file))) {}

Sequence::Sequence(const MeshScene& scene)
    : state_(
          std::make_unique<State>(SceneFile(scene.mesh, document_of(scene), scene.mesh.string()))) {
  if (scene.texels_per_unit) return;
  const json& color = state_->file.document()["materials"]["model"]["color"];
  std::ostringstream note;
  note << scene.mesh.filename().string() << ": --texels-per-unit "
       << color["texels_per_unit"].get<double>();
  state_->notes.push_back(note.str());
}

Sequence::~Sequence() = default;

int Sequence::frame_count() const {
  if (state_->turntable_frames > 0) return state_->turntable_frames;
  const json& document = state_->file.document();
  return document.contains("animation") ? document["animation"]["frames"].get<int>() : 1;
}

void Sequence::set_turntable(int frames) { state_->turntable_frames = frames; }

const Scene& Sequence::frame(int number) {
  const std::filesystem::path& path = state_->file.path();
  const std::string label =
      path.string() + (frame_count() > 1 ? " (frame " + std::to_string(number) + ")" : "");
  const SceneFile file(path, state_->document_of(number), label);
  const json before = std::exchange(state_->read, json());  // stays null if reading throws
  read_changes(file, before, state_->scene);
  state_->read = file.document();
  std::vector<std::string>& notes = state_->scene.notes;
  notes.insert(notes.end(), state_->notes.begin(), state_->notes.end());
  return state_->scene;
}

std::shared_ptr<const Scene> load_scene(const std::filesystem::path& path) {
  const auto sequence = std::make_shared<Sequence>(path);
  return {sequence, &sequence->frame(0)};
}

RenderSettings settings_of(const Scene& scene) { return scene.settings; }
Display display_of(const Scene& scene) { return scene.display; }
std::vector<std::string> notes_of(const Scene& scene) { return scene.notes; }

}  // namespace solidtex::pathtracer
