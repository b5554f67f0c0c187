// Exitance at samples, and its way out.
#include "bake/translucent_radiance.h"

#include "nacre/base/parallel.h"
#include "nacre/cache/exitance.h"
#include "nacre/cache/nearest.h"
#include "nacre/transport/surface.h"

namespace nacre {
namespace {

constexpr double kTolerance = 0.02;

}  // namespace

TranslucentRadiance::TranslucentRadiance(const World& world, std::span<const CacheGroup> groups,
                                         Progress& progress)
    : world_(world), cache_(groups) {
  for (std::size_t m = 0; m < groups.size(); ++m) {
    const CacheGroup& group = groups[m];
    const Medium& medium = world.media[m];
    groups_.push_back({std::vector<Rgb>(group.size()), exit_factor(medium)});
    const Exitance exitance(group, medium, kTolerance);
    progress.begin("exitance of " + group.name, "samples", group.size());
    // Samples are in octree order: neighbours share their work.
    parallel_for(group.size(), 4096, [&](std::size_t begin, std::size_t end) {
      std::vector<Vec3> positions;
      for (std::size_t i = begin; i < end; ++i) positions.push_back(group.position(i));
      std::uint64_t evaluations = 0;
      exitance.eval(positions, std::span(groups_[m].exitance).subspan(begin, end - begin), evaluations);
      progress.advance(end - begin);
    });
    progress.end();
  }
}

Rgb TranslucentRadiance::operator()(const Hit& hit, const Vec3& out) const {
  const auto m = static_cast<std::size_t>(world_.shape(hit).medium);
  const Group& group = groups_[m];
  const SurfacePoint point = surface_point(world_, hit);
  if (group.exitance.empty() || point.side(out) < 0) return {0, 0, 0};
  return group.exitance[find_nearest_sample(cache_[m], point.position, point.geometric_normal)] *
         exit_transmittance(world_, hit, point, out) * group.exit_factor;
}

}  // namespace nacre
