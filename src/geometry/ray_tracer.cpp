// The one file that talks to Embree.
#include "nacre/geometry/ray_tracer.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <tuple>

#include "nacre/base/error.h"

namespace nacre {
namespace {

struct ReleaseDevice {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct ReleaseScene {
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};

void check(RTCDevice device) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_NONE && device != nullptr) return;
  if (error == RTC_ERROR_OUT_OF_MEMORY)
    fail(ErrorCode::kLimit, "",
         "not enough memory to build the ray tracer; raise the limit or use smaller meshes");
  fail(ErrorCode::kIo, "", "Embree failed with error {}", static_cast<int>(error));
}

void attach(RTCDevice device, RTCScene scene, const Mesh& mesh, std::uint32_t index, std::uint32_t mask) {
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  check(device);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.triangles.data(), 0,
                             sizeof(Triangle), mesh.triangles.size());
  // Positions are copied: Embree reads 16 bytes at each vertex, and a vector ends after the last one's 12.
  void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           sizeof(Vec3), mesh.positions.size());
  if (vertices != nullptr) {
    std::copy(mesh.positions.begin(), mesh.positions.end(), static_cast<Vec3*>(vertices));
    rtcSetGeometryMask(geometry, mask);
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, index);
  }
  rtcReleaseGeometry(geometry);
  check(device);
}

// Embree wants 0 <= tnear; a NaN anywhere in the interval makes it empty.
bool has_interval(const Ray& ray) { return ray.t_max >= std::max(ray.t_min, 0.0f); }

void fill(RTCRay& to, const Ray& ray, std::uint32_t mask) {
  to.org_x = ray.origin.x;
  to.org_y = ray.origin.y;
  to.org_z = ray.origin.z;
  to.tnear = std::max(ray.t_min, 0.0f);
  to.dir_x = ray.direction.x;
  to.dir_y = ray.direction.y;
  to.dir_z = ray.direction.z;
  to.time = 0;
  to.tfar = ray.t_max;
  to.mask = mask;
  to.id = 0;
  to.flags = 0;
}

}  // namespace

struct RayTracer::Impl {
  std::unique_ptr<RTCDeviceTy, ReleaseDevice> device;
  std::unique_ptr<RTCSceneTy, ReleaseScene> scene;
  Box3 box;
};

RayTracer::RayTracer(std::span<const Mesh* const> meshes, std::span<const std::uint32_t> masks) {
  const auto impl = std::make_shared<Impl>();
  impl_ = impl;
  impl->device.reset(rtcNewDevice(nullptr));
  const RTCDevice device = impl->device.get();
  if (device == nullptr) check(device);
  impl->scene.reset(rtcNewScene(device));
  const RTCScene scene = impl->scene.get();
  check(device);
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
  for (std::uint32_t i = 0; i < meshes.size(); ++i) {
    if (meshes[i]->triangles.empty()) continue;
    attach(device, scene, *meshes[i], i, masks.empty() ? ~0u : masks[i]);
    impl->box.extendBy(nacre::bounds(*meshes[i]));
  }
  rtcCommitScene(scene);
  check(device);
}

Hit RayTracer::intersect(const Ray& ray, std::uint32_t mask) const noexcept {
  if (!has_interval(ray)) return {};
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query;
  fill(query.ray, ray, mask);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(impl_->scene.get(), &context, &query);
  static_assert(kNoHit == RTC_INVALID_GEOMETRY_ID);
  if (query.hit.geomID == kNoHit) return {};
  return {query.ray.tfar, query.hit.geomID, query.hit.primID, query.hit.u, query.hit.v};
}

bool RayTracer::occluded(const Ray& ray, std::uint32_t mask) const noexcept {
  if (!has_interval(ray)) return false;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay query;
  fill(query, ray, mask);
  rtcOccluded1(impl_->scene.get(), &context, &query);
  return query.tfar < 0;  // Embree's mark
}

namespace {

constexpr std::size_t kMostHits = 4096;

// What the filter of RayTracer::collect sees; the base has to come first.
struct Collector {
  RTCIntersectContext context;
  const std::uint8_t* passable;
  std::vector<Hit>* hits;
};

// Takes note of a hit and lets the ray go on, or ends it.
void collect_hit(const RTCFilterFunctionNArguments* arguments) {
  auto& collector = *reinterpret_cast<Collector*>(arguments->context);
  const auto& ray = *reinterpret_cast<const RTCRay*>(arguments->ray);
  const auto& hit = *reinterpret_cast<const RTCHit*>(arguments->hit);
  if (!collector.passable[hit.geomID] || collector.hits->size() >= kMostHits) return;
  collector.hits->push_back({ray.tfar, hit.geomID, hit.primID, hit.u, hit.v});
  arguments->valid[0] = 0;
}

}  // namespace

bool RayTracer::collect(const Ray& ray, std::span<const std::uint8_t> passable,
                        std::vector<Hit>& hits) const {
  hits.clear();
  if (!has_interval(ray)) return true;
  hits.reserve(16);
  Collector collector{{}, passable.data(), &hits};
  rtcInitIntersectContext(&collector.context);
  collector.context.filter = collect_hit;
  RTCRay query;
  fill(query, ray, ~0u);
  rtcOccluded1(impl_->scene.get(), &collector.context, &query);
  if (query.tfar < 0) return false;
  std::sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) {
    return std::tie(a.t, a.mesh, a.triangle) < std::tie(b.t, b.mesh, b.triangle);
  });
  // Triangles that the hierarchy has split are met once in each part.
  hits.erase(
      std::unique(hits.begin(), hits.end(),
                  [](const Hit& a, const Hit& b) { return a.mesh == b.mesh && a.triangle == b.triangle; }),
      hits.end());
  return true;
}

Box3 RayTracer::bounds() const noexcept { return impl_->box; }

Vec3 hit_position(const Mesh& mesh, const Hit& hit) noexcept {
  const Triangle& t = mesh.triangles[hit.triangle];
  const Vec3d a(mesh.positions[t[0]]), b(mesh.positions[t[1]]), c(mesh.positions[t[2]]);
  return Vec3(a + (b - a) * double{hit.u} + (c - a) * double{hit.v});
}

Vec3 shading_normal(const Mesh& mesh, const Hit& hit) noexcept {
  if (mesh.normals.empty()) return face_normal(mesh, hit.triangle);
  const Triangle& t = mesh.triangles[hit.triangle];
  const Vec3 n =
      mesh.normals[t[0]] * (1 - hit.u - hit.v) + mesh.normals[t[1]] * hit.u + mesh.normals[t[2]] * hit.v;
  const float length = n.length();
  return length > 0 ? n / length : face_normal(mesh, hit.triangle);
}

Vec2 texture_coordinates(const Mesh& mesh, const Hit& hit) noexcept {
  if (mesh.uvs.empty()) return {hit.u, hit.v};
  const Triangle& t = mesh.triangles[hit.triangle];
  return mesh.uvs[t[0]] * (1 - hit.u - hit.v) + mesh.uvs[t[1]] * hit.u + mesh.uvs[t[2]] * hit.v;
}

Vec3 u_tangent(const Mesh& mesh, std::uint32_t triangle) noexcept {
  if (mesh.uvs.empty()) return {0, 0, 0};
  const Triangle& t = mesh.triangles[triangle];
  const Vec2 d1 = mesh.uvs[t[1]] - mesh.uvs[t[0]], d2 = mesh.uvs[t[2]] - mesh.uvs[t[0]];
  const Vec3 e1 = mesh.positions[t[1]] - mesh.positions[t[0]];
  const Vec3 e2 = mesh.positions[t[2]] - mesh.positions[t[0]];
  const Vec3 tangent = e1 * d2.y - e2 * d1.y;
  return d1.cross(d2) < 0 ? -tangent : tangent;
}

float triangle_extent(const Mesh& mesh, std::uint32_t triangle) noexcept {
  const Triangle& t = mesh.triangles[triangle];
  const Vec3d a(mesh.positions[t[0]]), b(mesh.positions[t[1]]), c(mesh.positions[t[2]]);
  const double ab = (b - a).length(), bc = (c - b).length(), ca = (a - c).length();
  const double longest = std::max({ab, bc, ca});
  const double twice_area = (b - a).cross(c - a).length();
  const double limit = 1024 * longest;
  return static_cast<float>(ab * bc * ca < limit * twice_area ? ab * bc * ca / twice_area : limit);
}

Vec3 offset_from_surface(const Vec3& position, const Vec3& normal, float extent) noexcept {
  constexpr float kHalfUlp = 0x1p-24f;
  const float coordinate = std::max({std::abs(position.x), std::abs(position.y), std::abs(position.z)});
  // Rounding moves the position and the result by half an ulp in each coordinate: together at most
  // 2 sqrt(3) half ulps along the normal. Embree rounds its edges to a few half ulps of their length.
  return position + normal * (kHalfUlp * (8 * coordinate + 16 * extent));
}

}  // namespace nacre
