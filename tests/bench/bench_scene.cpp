// Scenes from files, resized and with more cameras.
#include "bench/bench_scene.h"

#include <malloc.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "nacre/cache/cache_file.h"
#include "nacre/scene/scene_file.h"

namespace nacre::bench {
namespace {

constexpr double kOrbit = 10;  // degrees

Box3 object_bounds(const Scene& scene) {
  Box3 box;
  for (const Shape& shape : scene.shapes)
    if (shape.medium != kNone) box.extendBy(bounds(shape.mesh));
  return box;
}

Camera orbit(const Camera& camera, const Vec3& centre, double degrees) {
  const Imath::V3d c(centre);
  Matrix4 to_centre, turn, back;
  to_centre.setTranslation(-c);
  turn.setAxisAngle(Imath::V3d(0, 1, 0), degrees * kPiD / 180);
  back.setTranslation(c);
  Camera result = camera;
  result.to_world = camera.to_world * to_centre * turn * back;
  return result;
}

}  // namespace

std::vector<BenchScene> bench_scenes() {
  const std::vector<std::string> both{"lit from behind", "lit from the front"};
  return {{"bunny50", "marble bunny 50 mm", "marble_bunny.xml", 50, both},
          {"bunny15", "marble bunny 15 mm", "marble_bunny.xml", 15, both},
          {"dragon", "jade dragon", "jade_dragon.xml", std::nullopt, {"lit from behind"}},
          {"better",
           "marble bunny 50 mm, better dipole",
           "marble_bunny.xml",
           50,
           {"lit from behind"},
           ProfileKind::kBetterDipole},
          {"normalized",
           "marble bunny 50 mm, normalized",
           "marble_bunny.xml",
           50,
           {"lit from behind"},
           ProfileKind::kNormalized},
          {"normalized_dragon",
           "jade dragon, normalized",
           "jade_dragon.xml",
           std::nullopt,
           {"lit from behind"},
           ProfileKind::kNormalized}};
}

Scene load_bench_scene(const BenchScene& spec) {
  Scene scene = load_scene(std::string(NACRE_SOURCE_DIR) + "/scenes/" + spec.file);
  const Box3 box = object_bounds(scene);
  if (spec.height_mm)
    for (Medium& medium : scene.media) medium.scale = static_cast<float>(*spec.height_mm / box.size().y);
  for (Medium& medium : scene.media) medium.profile = spec.profile;
  const Camera camera = scene.cameras[0];
  scene.cameras.clear();
  for (std::size_t view = 0; view < spec.views.size(); ++view)
    for (const double degrees : {0.0, kOrbit})
      scene.cameras.push_back(orbit(camera, box.center(), 180 * static_cast<double>(view) + degrees));
  scene.films.assign(scene.cameras.size(), Film(scene.films[0]));
  scene.integrator.emitter_samples = 1;
  return scene;
}

World make_frame_world(const Scene& scene) { return make_world(scene, false); }

Cache bake_samples(const Scene& scene, std::optional<double> points, std::optional<int> irradiance_samples) {
  BakeParams params;
  params.points = points;
  params.irradiance_samples = irradiance_samples;
  Progress progress;
  Report report;
  return bake(make_world(scene, params.shadows), plan_bake(scene, params), params, progress, report);
}

void reset_peak_memory() {
  ::malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << 5;
}

CacheFile::CacheFile(const Cache& cache)
    : path_(std::filesystem::temp_directory_path() / fmt::format("nacre_growth.{}.nacre", ::getpid())) {
  save_cache(cache, path_);
}

CacheFile::~CacheFile() {
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}

}  // namespace nacre::bench
