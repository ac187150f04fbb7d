#include "support/simulator/ray_caster.hpp"

#include "globalmatch/detail/core/threads.hpp"

#if GLOBALMATCH_EMBREE_MAJOR >= 4  // CMake says which one it links
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <span>
#include <stdexcept>
#include <string>

namespace globalmatch::support {
namespace {

enum geometry_id : unsigned { ground, stems, curves, discs };

struct release {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};

void require_no_error(RTCDevice device) {
  if (rtcGetDeviceError(device) != RTC_ERROR_NONE)
    throw std::runtime_error("Embree cannot prepare the scene; is there enough memory?");
}

template <class T>
void fill(RTCGeometry geometry, RTCDevice device, RTCBufferType type, RTCFormat format,
          const std::vector<T>& values) {
  void* buffer = rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(T), values.size());
  if (buffer == nullptr) require_no_error(device);
  std::copy(values.begin(), values.end(), static_cast<T*>(buffer));
}

void attach(RTCScene scene, RTCGeometry geometry, geometry_id id) {
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, id);
  rtcReleaseGeometry(geometry);
}

void add_quads(RTCDevice device, RTCScene scene, const quad_mesh& mesh, geometry_id id) {
  if (mesh.quads.empty()) return;
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_QUAD);
  fill(geometry, device, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, mesh.vertices);
  fill(geometry, device, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT4, mesh.quads);
  attach(scene, geometry, id);
}

void add_curves(RTCDevice device, RTCScene scene, const surfaces& all) {
  if (all.curves.empty()) return;
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_CONE_LINEAR_CURVE);
  fill(geometry, device, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, all.curve_points);
  fill(geometry, device, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT, all.curves);
  attach(scene, geometry, curves);
}

void add_discs(RTCDevice device, RTCScene scene, const surfaces& all) {
  if (all.discs.empty()) return;
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT);
  fill(geometry, device, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, all.discs);
  fill(geometry, device, RTC_BUFFER_TYPE_NORMAL, RTC_FORMAT_FLOAT3, all.disc_normals);
  attach(scene, geometry, discs);
}

RTCRayHit to_embree(const ray& r) {
  RTCRayHit query = {};
  query.ray.org_x = float(r.origin.x());
  query.ray.org_y = float(r.origin.y());
  query.ray.org_z = float(r.origin.z());
  query.ray.dir_x = float(r.direction.x());
  query.ray.dir_y = float(r.direction.y());
  query.ray.dir_z = float(r.direction.z());
  query.ray.tfar = std::numeric_limits<float>::infinity();
  query.ray.mask = ~0u;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  return query;
}

}  // namespace

struct ray_caster::prepared {
  std::unique_ptr<RTCDeviceTy, release> device;
  std::unique_ptr<RTCSceneTy, release> scene;
  std::vector<std::uint32_t> stem_of_quad;
};

ray_caster::ray_caster(const surfaces& scene, const execution& exec)
    : prepared_(std::make_unique<prepared>()) {
  const std::string configuration = "threads=" + std::to_string(detail::thread_count(exec));
  const RTCDevice device = rtcNewDevice(configuration.c_str());
  if (device == nullptr) require_no_error(nullptr);
  prepared_->device.reset(device);
  const RTCScene prepared_scene = rtcNewScene(device);
  prepared_->scene.reset(prepared_scene);
  prepared_->stem_of_quad = scene.stem_of_quad;

  rtcSetSceneFlags(prepared_scene, RTC_SCENE_FLAG_ROBUST);  // no ray slips between two triangles
  add_quads(device, prepared_scene, scene.ground, ground);
  add_quads(device, prepared_scene, scene.stems, stems);
  add_curves(device, prepared_scene, scene);
  add_discs(device, prepared_scene, scene);
  rtcCommitScene(prepared_scene);
  require_no_error(device);
}

ray_caster::~ray_caster() = default;
ray_caster::ray_caster(ray_caster&&) noexcept = default;
ray_caster& ray_caster::operator=(ray_caster&&) noexcept = default;

hit ray_caster::first_hit(const ray& r) const {
  RTCRayHit query = to_embree(r);
#if GLOBALMATCH_EMBREE_MAJOR >= 4
  rtcIntersect1(prepared_->scene.get(), &query);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(prepared_->scene.get(), &context, &query);
#endif
  const double range = double(query.ray.tfar);
  switch (query.hit.geomID) {
    case RTC_INVALID_GEOMETRY_ID:
      return {};
    case ground:
      return {range, surface::ground};
    case stems:
      return {range, surface::stem, prepared_->stem_of_quad[query.hit.primID]};
    default:
      return {range, surface::other};
  }
}

}  // namespace globalmatch::support
