#include "plugins/pathtracer/geometry/embree_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_inverse.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <stdexcept>

namespace solidtex::pathtracer {
namespace {

void check(RTCDevice device, const char* what) {
  if (const RTCError error = rtcGetDeviceError(device); error != RTC_ERROR_NONE) {
    throw std::runtime_error(std::string("Embree failed to ") + what + ", error code " +
                             std::to_string(static_cast<int>(error)));
  }
}

// Copies values into a buffer owned and padded by Embree.
template <class T>
void fill_buffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format,
                 const std::vector<T>& values) {
  auto* buffer =
      static_cast<T*>(rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(T), values.size()));
  if (!buffer) throw std::bad_alloc();
  std::copy(values.begin(), values.end(), buffer);
}

void commit_and_attach(RTCScene scene, RTCGeometry geometry, unsigned id) {
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, id);
  rtcReleaseGeometry(geometry);
}

RTCGeometry triangles(RTCDevice device, const Mesh& mesh, const std::vector<glm::vec3>& positions) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  fill_buffer(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, positions);
  fill_buffer(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, mesh.triangles);
  return geometry;
}

RTCRay to_embree(const glm::vec3& origin, const glm::vec3& direction, float distance) {
  RTCRay result{};
  result.org_x = origin.x, result.org_y = origin.y, result.org_z = origin.z;
  result.dir_x = direction.x, result.dir_y = direction.y, result.dir_z = direction.z;
  result.tfar = distance;
  result.mask = 0xffffffffu;
  return result;
}

template <class Packet>
void set_lane(Packet& packet, int lane, const glm::vec3& origin, const glm::vec3& direction,
              float distance) {
  packet.org_x[lane] = origin.x, packet.org_y[lane] = origin.y, packet.org_z[lane] = origin.z;
  packet.dir_x[lane] = direction.x, packet.dir_y[lane] = direction.y;
  packet.dir_z[lane] = direction.z;
  packet.tnear[lane] = 0, packet.tfar[lane] = distance;
  packet.time[lane] = 0, packet.mask[lane] = 0xffffffffu;
  packet.id[lane] = packet.flags[lane] = 0;
}

// Calls visit(first, count) for each packet of `total` rays.
template <int kWidth, class Visit>
void for_each_packet(std::size_t total, const Visit& visit) {
  for (std::size_t first = 0; first < total; first += kWidth) {
    visit(first, static_cast<int>(std::min<std::size_t>(kWidth, total - first)));
  }
}

template <int kWidth>
struct alignas(64) Lanes {
  int valid[kWidth];
  explicit Lanes(int count) {
    for (int i = 0; i < kWidth; ++i) valid[i] = i < count ? -1 : 0;
  }
};

int native_packet_width(RTCDevice device) {
  const auto has = [&](RTCDeviceProperty property) {
    return rtcGetDeviceProperty(device, property) != 0;
  };
  if (has(RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)) return 16;
  return has(RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) ? 8 : 4;
}

template <class T>
T interpolate(const std::vector<T>& values, const glm::uvec3& corner, const glm::vec2& b) {
  return (1 - b.x - b.y) * values[corner.x] + b.x * values[corner.y] + b.y * values[corner.z];
}

glm::vec3 on_side_of(const glm::vec3& normal, const glm::vec3& reference) {
  return glm::dot(normal, reference) < 0 ? -normal : normal;
}

}  // namespace

EmbreeScene::EmbreeScene(const Scene& scene) : scene_(scene), device_(rtcNewDevice(nullptr)) {
  if (!device_) throw std::runtime_error("Embree cannot start on this machine");
  // Packets round the distance of a sphere differently than single rays.
  packet_width_ = scene.sphere_lights.empty() ? native_packet_width(device_.get()) : 1;
  std::vector<int> uses(scene.meshes.size());
  for (const Object& object : scene.objects) ++uses[object.mesh];
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
    meshes_.push_back(uses[i] > 1 ? build_mesh(scene.meshes[i]) : nullptr);
  }
  root_.reset(rtcNewScene(device_.get()));
  rtcSetSceneFlags(root_.get(), RTC_SCENE_FLAG_ROBUST);
  unsigned id = 0;
  for (const Object& object : scene.objects) attach_object(object, id++);
  for (const RectangleLight& light : scene.lights) attach_light(light, id++);
  for (const SphereLight& light : scene.sphere_lights) attach_light(light, id++);
  for (const MeshLight& light : scene.mesh_lights) attach_light(light, id++);
  rtcCommitScene(root_.get());
  check(device_.get(), "build the scene");
}

EmbreeScene::Owned<RTCScene> EmbreeScene::build_mesh(const Mesh& mesh) const {
  RTCGeometry geometry = triangles(device_.get(), mesh, mesh.positions);
  Owned<RTCScene> result(rtcNewScene(device_.get()));
  rtcSetSceneFlags(result.get(), RTC_SCENE_FLAG_ROBUST);
  commit_and_attach(result.get(), geometry, 0);
  rtcCommitScene(result.get());
  check(device_.get(), ("build " + mesh.file).c_str());
  return result;
}

void EmbreeScene::attach_object(const Object& object, unsigned id) {
  if (meshes_[object.mesh]) {
    attach_instance(object, id);
  } else {
    attach_triangles(object, id);
  }
  normal_matrices_.push_back(glm::inverseTranspose(glm::mat3(object.to_world)));
  const glm::mat3 linear(object.to_world);
  object_scales_.push_back(1 / std::cbrt(std::abs(glm::determinant(linear))));
}

void EmbreeScene::attach_instance(const Object& object, unsigned id) {
  RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(geometry, meshes_[object.mesh].get());
  rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR,
                          glm::value_ptr(object.to_world));
  commit_and_attach(root_.get(), geometry, id);
}

// The triangles of a mesh that no other object shares are in world space, which saves transforming
// rays: about 5 % of the intersection time of one large mesh.
void EmbreeScene::attach_triangles(const Object& object, unsigned id) {
  const Mesh& mesh = scene_.meshes[object.mesh];
  std::vector<glm::vec3> positions = mesh.positions;
  for (glm::vec3& p : positions) p = glm::vec3(object.to_world * glm::vec4(p, 1));
  commit_and_attach(root_.get(), triangles(device_.get(), mesh, positions), id);
  check(device_.get(), ("build " + mesh.file).c_str());
}

void EmbreeScene::attach_light(const RectangleLight& light, unsigned id) {
  const std::vector<glm::vec3> corners = {light.corner, light.corner + light.edge_u,
                                          light.corner + light.edge_u + light.edge_v,
                                          light.corner + light.edge_v};
  RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_QUAD);
  fill_buffer(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, corners);
  fill_buffer(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT4,
              std::vector<glm::uvec4>{{0, 1, 2, 3}});
  commit_and_attach(root_.get(), geometry, id);
}

void EmbreeScene::attach_light(const SphereLight& light, unsigned id) {
  RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_SPHERE_POINT);
  fill_buffer(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4,
              std::vector<glm::vec4>{glm::vec4(light.center, light.radius)});
  commit_and_attach(root_.get(), geometry, id);
}

void EmbreeScene::attach_light(const MeshLight& light, unsigned id) {
  commit_and_attach(root_.get(), triangles(device_.get(), light.mesh, light.mesh.positions), id);
}

// Sets the kind and the index only.
Hit EmbreeScene::to_hit(unsigned instance, unsigned geometry) const {
  Hit hit;
  if (geometry == RTC_INVALID_GEOMETRY_ID) return hit;
  const unsigned id = instance != RTC_INVALID_GEOMETRY_ID ? instance : geometry;
  const auto object_count = static_cast<std::uint32_t>(scene_.objects.size());
  if (id < object_count) {
    hit.kind = Hit::Kind::object;
    hit.index = id;
  } else {
    hit.kind = Hit::Kind::light;
    hit.index = id - object_count;
  }
  return hit;
}

Hit EmbreeScene::intersect(const Ray& ray) const {
  RTCRayHit query{};
  query.ray = to_embree(ray.origin, ray.direction, std::numeric_limits<float>::infinity());
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  embree_intersect(root_.get(), query);
  Hit hit = to_hit(query.hit.instID[0], query.hit.geomID);
  if (hit.kind == Hit::Kind::nothing) return hit;
  hit.triangle = query.hit.primID;
  hit.barycentric = {query.hit.u, query.hit.v};
  hit.distance = query.ray.tfar;
  return hit;
}

bool EmbreeScene::occluded(const ShadowRay& ray) const {
  RTCRay query = to_embree(ray.origin, ray.direction, ray.distance);
  embree_occluded(root_.get(), query);
  return query.tfar < 0;
}

template <int kWidth>
void EmbreeScene::intersect_packets(std::span<const Ray> rays, bool coherent,
                                    std::span<Hit> hits) const {
  typename EmbreePacket<kWidth>::RayHit query;
  for_each_packet<kWidth>(rays.size(), [&](std::size_t first, int count) {
    for (int i = 0; i < count; ++i) {
      const Ray& ray = rays[first + static_cast<std::size_t>(i)];
      set_lane(query.ray, i, ray.origin, ray.direction, std::numeric_limits<float>::infinity());
      query.hit.geomID[i] = query.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
    embree_intersect<kWidth>(root_.get(), Lanes<kWidth>(count).valid, coherent, query);
    for (int i = 0; i < count; ++i) {
      Hit& hit = hits[first + static_cast<std::size_t>(i)];
      hit = to_hit(query.hit.instID[0][i], query.hit.geomID[i]);
      if (hit.kind == Hit::Kind::nothing) continue;
      hit.triangle = query.hit.primID[i];
      hit.barycentric = {query.hit.u[i], query.hit.v[i]};
      hit.distance = query.ray.tfar[i];
    }
  });
}

template <int kWidth>
void EmbreeScene::occluded_packets(std::span<const ShadowRay> rays,
                                   std::span<std::uint8_t> results) const {
  typename EmbreePacket<kWidth>::Ray query;
  for_each_packet<kWidth>(rays.size(), [&](std::size_t first, int count) {
    for (int i = 0; i < count; ++i) {
      const ShadowRay& ray = rays[first + static_cast<std::size_t>(i)];
      set_lane(query, i, ray.origin, ray.direction, ray.distance);
    }
    embree_occluded<kWidth>(root_.get(), Lanes<kWidth>(count).valid, query);
    for (int i = 0; i < count; ++i) {
      results[first + static_cast<std::size_t>(i)] = query.tfar[i] < 0;
    }
  });
}

void EmbreeScene::intersect(std::span<const Ray> rays, bool coherent, std::span<Hit> hits) const {
  switch (packet_width_) {
    case 16:
      return intersect_packets<16>(rays, coherent, hits);
    case 8:
      return intersect_packets<8>(rays, coherent, hits);
    case 4:
      return intersect_packets<4>(rays, coherent, hits);
    default:
      for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = intersect(rays[i]);
  }
}

void EmbreeScene::occluded(std::span<const ShadowRay> rays, std::span<std::uint8_t> results) const {
  switch (packet_width_) {
    case 16:
      return occluded_packets<16>(rays, results);
    case 8:
      return occluded_packets<8>(rays, results);
    case 4:
      return occluded_packets<4>(rays, results);
    default:
      for (std::size_t i = 0; i < rays.size(); ++i) results[i] = occluded(rays[i]);
  }
}

SurfaceInteraction EmbreeScene::interaction(const Ray& ray, const Hit& hit) const {
  const Object& object = scene_.objects[hit.index];
  const Mesh& mesh = scene_.meshes[object.mesh];
  const glm::uvec3 corner = mesh.triangles[hit.triangle];
  const glm::mat3& to_world_normal = normal_matrices_[hit.index];
  const auto& p = mesh.positions;

  SurfaceInteraction interaction;
  interaction.object = hit.index;
  interaction.material = static_cast<std::uint32_t>(object.material);
  interaction.object_position = interpolate(p, corner, hit.barycentric);
  interaction.position = glm::vec3(object.to_world * glm::vec4(interaction.object_position, 1));
  const glm::vec3 face = glm::cross(p[corner.y] - p[corner.x], p[corner.z] - p[corner.x]);
  const glm::vec3 outward = glm::normalize(to_world_normal * glm::normalize(face));
  interaction.inside = glm::dot(outward, ray.direction) > 0;
  interaction.geometric_normal = interaction.inside ? -outward : outward;
  interaction.normal = interaction.geometric_normal;
  if (!mesh.normals.empty()) {
    const glm::vec3 smooth = to_world_normal * interpolate(mesh.normals, corner, hit.barycentric);
    const float length = glm::length(smooth);
    const glm::vec3 normal =
        on_side_of(length > 0 ? smooth / length : interaction.normal, interaction.geometric_normal);
    // An interpolated normal may face away from the viewer near a silhouette; the face never does.
    if (glm::dot(normal, ray.direction) < 0) interaction.normal = normal;
  }
  // The circle with the area of the cone's ellipse on the surface.
  const float cosine = -glm::dot(interaction.geometric_normal, ray.direction);
  interaction.view = ray.direction;
  interaction.footprint = ray.radius_at(hit.distance) / std::sqrt(std::max(cosine, kMinCosine));
  interaction.object_scale = object_scales_[hit.index];
  if (!mesh.uvs.empty()) interaction.uv = interpolate(mesh.uvs, corner, hit.barycentric);
  if (!mesh.attribute.empty()) {
    interaction.attribute = interpolate(mesh.attribute, corner, hit.barycentric);
  }
  return interaction;
}

glm::vec3 EmbreeScene::offset_ray_origin(const SurfaceInteraction& interaction,
                                         const glm::vec3& direction) const {
  // Some tens of units in the last place of the largest coordinate: above the rounding error of the
  // position, below anything visible.
  const glm::vec3 size = glm::abs(interaction.position);
  const float extent = std::max({size.x, size.y, size.z, 1e-3f});
  const float offset = extent * 0x1p-18f;
  return interaction.position + on_side_of(interaction.geometric_normal, direction) * offset;
}

}  // namespace solidtex::pathtracer
