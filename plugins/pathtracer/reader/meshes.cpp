#include "plugins/pathtracer/reader/meshes.h"

#include "plugins/pathtracer/reader/schema.h"

namespace solidtex::pathtracer {

using nlohmann::json;

std::size_t MeshReader::mesh_of(const Place& object, const std::string& attribute) {
  const json& value = file_.at(object);
  const std::string key =
      value["mesh"].dump() + value.value("cuts", json()).dump() + json(attribute).dump();
  if (const auto known = meshes_.find(key); known != meshes_.end()) return known->second;
  if (!attribute.empty() && value.contains("cuts")) {
    file_.refuse(
        object / "cuts", "cuts of a mesh whose vertices have the attribute " + attribute,
        "none, because cut faces have no vertices of the file (a mix by a plane, sphere or "
        "box goes through the solid)");
  }
  Mesh mesh = read_mesh(object / "mesh", attribute);
  boxes_[scene_.meshes.size()] = mesh::bounding_box(mesh);
  if (value.contains("cuts")) mesh = cut(object / "cuts", mesh);
  scene_.meshes.push_back(std::move(mesh));
  return meshes_[key] = scene_.meshes.size() - 1;
}

Mesh MeshReader::read_mesh(const Place& place, const std::string& attribute) {
  return file_.load(place, [&] {
    Mesh mesh = load_mesh(file_.resolve(place), attribute);
    const MeshReport report = repair_mesh(mesh);
    if (mesh.triangles.empty()) {
      throw SceneError(mesh.file + ": found only degenerate triangles, expected a surface");
    }
    if (can_repair_meshes() && !report.closed) open_files_.insert(mesh.file);
    scene_.notes.push_back(describe(mesh, report));
    const std::string name = std::filesystem::path(mesh.file).filename().string();
    for (const std::string& warning : mesh.warnings) scene_.notes.push_back(name + ": " + warning);
    return mesh;
  });
}

Mesh MeshReader::cut(const Place& place, const Mesh& mesh) {
  std::vector<Cut> cuts;
  const std::size_t count = file_.at(place).size();
  for (std::size_t i = 0; i < count; ++i) cuts.push_back(read_cut(place / i, mesh));
  return file_.load(place, [&] { return cut_mesh(mesh, cuts); });
}

Cut MeshReader::read_cut(const Place& place, const Mesh& mesh) {
  Cut cut;
  const json& value = file_.at(place);
  if (value.contains("clip")) {
    const json& plane = value["clip"];
    if (to_vec3(plane["normal"]) == glm::vec3(0)) {
      file_.refuse(place / "clip" / "normal", quote_json(plane["normal"]), "a direction");
    }
    const glm::vec3 point(to_dvec3(plane["point"]) - mesh.origin);
    cut.tool = make_half_space(point, to_vec3(plane["normal"]), mesh);
    cut.tool.file = "the clip plane";
    return cut;
  }
  const bool subtract = value.contains("subtract");
  cut.operation = subtract ? Cut::Operation::subtract : Cut::Operation::intersect;
  const Place shape = place / (subtract ? "subtract" : "intersect");
  cut.tool = read_tool(shape);
  transform_mesh(cut.tool, file_.transform(shape / "transform"), mesh.origin);
  return cut;
}

Mesh MeshReader::read_tool(const Place& place) {
  const json& shape = file_.at(place);
  if (shape.contains("box")) return make_box(glm::vec3(to_scale(shape["box"])));
  if (shape.contains("sphere")) return make_sphere(shape["sphere"]);
  return read_mesh(place / "mesh");
}

}  // namespace solidtex::pathtracer
