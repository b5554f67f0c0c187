// Rounds of light.
#include "bake/illumination.h"

#include "bake/translucent_radiance.h"
#include "nacre/base/random.h"
#include "nacre/cache/octree.h"

namespace nacre {
namespace {

// Rounds of light between translucent objects.
constexpr int kInterreflections = 2;

}  // namespace

std::vector<CacheGroup> build_groups(const BakePlan& plan, std::span<const double> areas,
                                     std::vector<SurfaceSamples> samples,
                                     std::vector<std::shared_ptr<const void>>& storage, Report& report) {
  const StageTimer timer(report, "build_octree");
  std::vector<CacheGroup> groups;
  for (std::size_t m = 0; m < samples.size(); ++m)
    groups.push_back(build_group(plan.groups[m].name, areas[m], std::move(samples[m]), storage));
  return groups;
}

std::vector<SampleLight> Illumination::compute(const World& world, std::size_t plane) {
  std::vector<SampleLight> lights = compute_round(world, plane, 0, {});
  for (int round = 1; params_.interreflect && round <= kInterreflections; ++round) {
    std::vector<std::shared_ptr<const void>> storage;
    std::vector<SurfaceSamples> samples;
    std::vector<double> areas;
    for (std::size_t m = 0; m < placed_.size(); ++m) {
      const SurfaceSamples& own = placed_[m].samples;
      samples.push_back({own.positions, own.normals, own.areas, std::move(lights[m].irradiance), {}});
      areas.push_back(placed_[m].surface_area);
    }
    const std::vector<CacheGroup> groups = build_groups(plan_, areas, std::move(samples), storage, report_);
    const TranslucentRadiance radiance = [&] {
      const StageTimer timer(report_, "diffusion");
      return TranslucentRadiance(world, groups, progress_);
    }();
    lights = compute_round(world, plane, round, std::cref(radiance));
  }
  return lights;
}

std::vector<SampleLight> Illumination::compute_round(const World& world, std::size_t plane, int round,
                                                     const TranslucentAnswer& answer) {
  const StageTimer timer(report_, "irradiance");
  std::vector<SampleLight> lights;
  for (std::size_t m = 0; m < placed_.size(); ++m) {
    const PlacedSamples& placed = placed_[m];
    const std::uint64_t pass =
        (plane * (kInterreflections + 1) + static_cast<std::size_t>(round)) * placed_.size() + m;
    lights.push_back(compute_irradiance(
        world, {placed.samples.positions, placed.samples.normals, placed.extents, placed.albedos},
        world.media[m].eta(),
        {plan_.groups[m].irradiance_samples, plan_.groups[m].bounces, params_.irradiance_error,
         keeps_every_eta(*world.scene, params_), hash_words(params_.seed, m, 1), &journal_, pass},
        progress_, answer));
  }
  return lights;
}

}  // namespace nacre
