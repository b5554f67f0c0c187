// Stages of bakes, beside the shadow rays that they cannot do without.
#include "bench/bake_growth.h"

#include "bench/bare_rays.h"
#include "bench/bench_scene.h"
#include "nacre/base/random.h"
#include "nacre/base/sampling.h"

namespace nacre::bench {
namespace {

constexpr std::size_t kMostRays = 2'000'000;

// One connection from each of the samples (of every so many, if they are more than kMostRays) to each area
// light, where both face each other. `share` becomes that of the connections that do.
std::vector<Ray> make_shadow_rays(const Scene& scene, const Cache& cache, double& share) {
  std::vector<Ray> rays;
  std::size_t tried = 0;
  for (const Light& light : scene.lights) {
    const auto* area_light = std::get_if<AreaLight>(&light.model);
    if (!area_light) continue;
    const Mesh& mesh = scene.shapes[area_light->shape].mesh;
    const Distribution areas(triangle_areas(mesh));
    Rng rng(1);
    for (const CacheGroup& group : cache.groups)
      for (std::size_t i = 0; i < group.size(); i += 1 + group.size() / kMostRays) {
        double u = static_cast<double>(rng.next_float());
        const auto triangle = static_cast<std::uint32_t>(areas.sample(u));
        const float v = rng.next_float();
        const Vec2 b = sample_uniform_triangle({rng.next_float(), v});
        const Vec3 to = hit_position(mesh, {0, 0, triangle, b.x, b.y}), normal = group.normal(i),
                   from = offset_from_surface(group.position(i), normal, 0), way = to - from;
        ++tried;
        if (dot(way, normal) > 0 && dot(way, face_normal(mesh, triangle)) < 0)
          rays.push_back({from, way, 0, 0.999f});
      }
  }
  share = static_cast<double>(rays.size()) / static_cast<double>(tried);
  return rays;
}

BakeRow measure(const Scene& scene, double samples) {
  const World world = make_world(scene, true);
  BakeParams params;
  params.points = samples;
  params.irradiance_samples = kIrradianceSamples;
  params.bounces = 0;
  Progress progress;
  Report report;
  reset_peak_memory();
  const auto before = static_cast<double>(peak_memory_bytes());
  const Stopwatch watch;
  const Cache cache = bake(world, plan_bake(scene, params), params, progress, report);
  BakeRow row;
  row.total_seconds = watch.seconds();
  row.peak_bytes = static_cast<double>(peak_memory_bytes()) - before;
  row.samples = static_cast<double>(cache.sample_count());
  row.placement_seconds = report.seconds["place_samples"];
  row.irradiance_seconds = report.seconds["irradiance"];
  row.octree_seconds = report.seconds["build_octree"];
  const Stopwatch write_watch;
  const CacheFile file(cache);
  row.write_seconds = write_watch.seconds();
  row.total_seconds += row.write_seconds;

  double facing = 0;
  const std::vector<Ray> rays = make_shadow_rays(scene, cache, facing);
  std::size_t lights = 0;
  for (const Light& light : scene.lights) lights += std::holds_alternative<AreaLight>(light.model);
  row.shadow_rays = row.samples * static_cast<double>(lights) * kIrradianceSamples * facing;
  row.bare_seconds =
      time_bare_shadow_rays(scene, rays, 3) * row.shadow_rays / static_cast<double>(rays.size());
  return row;
}

}  // namespace

void measure_bakes(double most_samples, int runs, Results& results) {
  const Scene scene = load_bench_scene(bench_scenes().front());
  for (const double samples : {10e3, 100e3, 1e6, 10e6}) {
    if (samples > most_samples) break;
    fmt::print(stderr, "bake: {:.0f} samples\n", samples);
    std::vector<BakeRow> rows;
    for (int run = 0; run < runs; ++run) rows.push_back(measure(scene, samples));
    std::ranges::sort(rows, {}, &BakeRow::total_seconds);
    results.bakes.push_back(rows[rows.size() / 2]);
  }
}

}  // namespace nacre::bench
