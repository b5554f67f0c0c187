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

// An Embree scene like that of RayTracer.
class BareScene {
 public:
  explicit BareScene(const Scene& scene)
      : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_.get())) {
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
    rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_HIGH);
    for (std::size_t i = 0; i < scene.shapes.size(); ++i)
      if (!scene.shapes[i].mesh.triangles.empty())
        attach(device_.get(), scene_.get(), scene.shapes[i].mesh, static_cast<unsigned>(i));
    rtcCommitScene(scene_.get());
    if (rtcGetDeviceError(device_.get()) != RTC_ERROR_NONE)
      fail(ErrorCode::kIo, "Embree", "could not build a scene for the bare loop");
  }
  RTCScene get() const { return scene_.get(); }

 private:
  std::unique_ptr<RTCDeviceTy, ReleaseDevice> device_;
  std::unique_ptr<RTCSceneTy, ReleaseScene> scene_;
};

void fill(RTCRay& query, const Ray& ray) noexcept {
  query.org_x = ray.origin.x;
  query.org_y = ray.origin.y;
  query.org_z = ray.origin.z;
  query.tnear = ray.t_min;
  query.dir_x = ray.direction.x;
  query.dir_y = ray.direction.y;
  query.dir_z = ray.direction.z;
  query.time = 0;
  query.tfar = ray.t_max;
  query.mask = ~0u;
  query.id = 0;
  query.flags = 0;
}

float trace(RTCScene scene, const Ray& ray) noexcept {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query;
  fill(query.ray, ray);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene, &context, &query);
  return query.hit.geomID == RTC_INVALID_GEOMETRY_ID ? 0 : query.ray.tfar;
}

bool is_blocked(RTCScene scene, const Ray& ray) noexcept {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay query;
  fill(query, ray);
  rtcOccluded1(scene, &context, &query);
  return query.tfar < 0;
}

// Median seconds of visit(i) for all i, on all threads.
template <class Visit>
double time_loop(std::size_t count, int runs, const Visit& visit) {
  std::vector<double> seconds;
  for (int run = 0; run < runs; ++run) {
    const Stopwatch watch;
    parallel_for((count + kRaysPerTask - 1) / kRaysPerTask, 1, [&](std::size_t begin, std::size_t end) {
      const std::size_t last = std::min(end * kRaysPerTask, count);
      for (std::size_t i = begin * kRaysPerTask; i < last; ++i) visit(i);
    });
    seconds.push_back(watch.seconds());
  }
  return median(seconds);
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
  const BareScene meshes(scene);
  BareRays result{0, std::vector<float>(rays.size())};
  result.seconds =
      time_loop(rays.size(), runs, [&](std::size_t i) { result.distance[i] = trace(meshes.get(), rays[i]); });
  return result;
}

double time_bare_shadow_rays(const Scene& scene, const std::vector<Ray>& rays, int runs) {
  const BareScene meshes(scene);
  std::vector<std::uint8_t> blocked(rays.size());  // what is found has to go somewhere
  return time_loop(rays.size(), runs, [&](std::size_t i) { blocked[i] = is_blocked(meshes.get(), rays[i]); });
}

double differing_share(const BareRays& rays, const Image& frame) {
  const Channel* const depth = find_channel(frame, "depth.Z");
  std::size_t differing = 0;
  for (std::size_t i = 0; i < rays.distance.size(); ++i) differing += rays.distance[i] != depth->values[i];
  return static_cast<double>(differing) / static_cast<double>(rays.distance.size());
}

}  // namespace nacre::bench
