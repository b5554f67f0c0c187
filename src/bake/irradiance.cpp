// Transmitted irradiance at samples.
#include "nacre/transport/irradiance.h"

#include "nacre/bake/bake.h"
#include "nacre/base/parallel.h"
#include "nacre/base/random.h"

namespace nacre {

std::vector<Rgb> compute_irradiance(const World& world, const ReceiverPoints& points, float eta, int samples,
                                    int bounces, std::uint64_t seed, Progress& progress,
                                    const TranslucentAnswer& answer) {
  std::vector<Rgb> irradiance(points.positions.size());
  progress.begin("computing irradiance", "samples", points.positions.size());
  parallel_for(points.positions.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3& normal = points.normals[i];
      Receiver at{points.positions[i], normal,
                  offset_from_surface(points.positions[i], normal, points.extents[i]), eta};
      if (!points.albedos.empty()) at.albedo = points.albedos[i];
      irradiance[i] = estimate_irradiance(world, at, samples, bounces, hash_words(seed, i), 0, answer);
    }
    progress.advance(end - begin);
  });
  progress.end();
  return irradiance;
}

}  // namespace nacre
