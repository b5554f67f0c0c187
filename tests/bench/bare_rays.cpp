// Embree without nacre around it.
#include "bench/bare_rays.h"

#include <embree3/rtcore.h>

#include "bench/results.h"
#include "nacre/base/parallel.h"
#include "nacre/base/random.h"
#include "nacre/render/camera.h"

namespace nacre::bench {
namespace {

constexpr std::size_t kRaysPerTask = 1 << 15;  // as many as the renderer's tasks have

struct ReleaseDevice {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct ReleaseScene {
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};

void attach(RTCDevice device, RTCScene scene, const Mesh& mesh, unsigned index) {
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.triangles.data(), 0,
                             sizeof(Triangle), mesh.triangles.size());
  void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           sizeof(Vec3), mesh.positions.size());
  std::copy(mesh.positions.begin(), mesh.positions.end(), static_cast<Vec3*>(vertices));
  rtcSetGeometryMask(geometry, ~0u);
  rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, index);
  rtcReleaseGeometry(geometry);
}

float trace(RTCScene scene, const Ray& ray) noexcept {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query;
  query.ray.org_x = ray.origin.x;
  query.ray.org_y = ray.origin.y;
  query.ray.org_z = ray.origin.z;
  query.ray.tnear = ray.t_min;
  query.ray.dir_x = ray.direction.x;
  query.ray.dir_y = ray.direction.y;
  query.ray.dir_z = ray.direction.z;
  query.ray.time = 0;
  query.ray.tfar = ray.t_max;
  query.ray.mask = ~0u;
  query.ray.id = 0;
  query.ray.flags = 0;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene, &context, &query);
  return query.hit.geomID == RTC_INVALID_GEOMETRY_ID ? 0 : query.ray.tfar;
}

}  // namespace

// Random numbers as in PixelLoop.
std::vector<Ray> make_primary_rays(const Scene& scene, const RenderParams& params) {
  const CameraRays camera(scene.cameras[params.camera], params.width, params.height);
  const FilterSampler filter(scene.films[params.camera]);
  std::vector<Ray> rays;
  for (int y = 0; y < params.height; ++y)
    for (int x = 0; x < params.width; ++x) {
      const std::uint64_t key =
          hash_words(params.seed, static_cast<std::uint64_t>(x), static_cast<std::uint64_t>(y), 0);
      const Vec2 centre(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      rays.push_back(
          camera.at(centre + filter.sample(sobol_2d(0, key)).offset, sobol_2d(0, hash_words(key, 1))));
    }
  return rays;
}

BareRays time_bare_rays(const Scene& scene, const std::vector<Ray>& rays, int runs) {
  const std::unique_ptr<RTCDeviceTy, ReleaseDevice> device(rtcNewDevice(nullptr));
  const std::unique_ptr<RTCSceneTy, ReleaseScene> meshes(rtcNewScene(device.get()));
  rtcSetSceneFlags(meshes.get(), RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
  rtcSetSceneBuildQuality(meshes.get(), RTC_BUILD_QUALITY_HIGH);
  for (std::size_t i = 0; i < scene.shapes.size(); ++i)
    if (!scene.shapes[i].mesh.triangles.empty())
      attach(device.get(), meshes.get(), scene.shapes[i].mesh, static_cast<unsigned>(i));
  rtcCommitScene(meshes.get());
  if (rtcGetDeviceError(device.get()) != RTC_ERROR_NONE)
    fail(ErrorCode::kIo, "Embree", "could not build a scene for the bare loop");

  BareRays result{0, std::vector<float>(rays.size())};
  std::vector<double> seconds;
  for (int run = 0; run < runs; ++run) {
    const Stopwatch watch;
    parallel_for((rays.size() + kRaysPerTask - 1) / kRaysPerTask, 1, [&](std::size_t begin, std::size_t end) {
      const std::size_t last = std::min(end * kRaysPerTask, rays.size());
      for (std::size_t i = begin * kRaysPerTask; i < last; ++i)
        result.distance[i] = trace(meshes.get(), rays[i]);
    });
    seconds.push_back(watch.seconds());
  }
  result.seconds = median(seconds);
  return result;
}

double differing_share(const BareRays& rays, const Image& frame) {
  const Channel* const depth = find_channel(frame, "depth.Z");
  std::size_t differing = 0;
  for (std::size_t i = 0; i < rays.distance.size(); ++i) differing += rays.distance[i] != depth->values[i];
  return static_cast<double>(differing) / static_cast<double>(rays.distance.size());
}

}  // namespace nacre::bench
