// Transmitted irradiance at samples.
#include "nacre/bake/bake.h"
#include "nacre/base/parallel.h"
#include "nacre/base/random.h"
#include "nacre/optics/fresnel.h"
#include "nacre/transport/light.h"

namespace nacre {
namespace {

struct Receiver {
  Vec3 position, normal, origin;  // origin: just off the surface
  float eta;
};

Rgb direct_irradiance(const World& world, const Receiver& at, int samples, std::uint64_t key) {
  Rgb sum(0, 0, 0);
  for_each_connection(world, at.position, at.normal, samples, key, 0, [&](const Connection& connection) {
    const LightSample& sample = connection.sample;
    const float cosine = dot(sample.direction, at.normal);
    if (cosine > 0 && is_visible(world, at.origin, sample))
      sum += sample.irradiance * (cosine * (1 - fresnel_reflectance(cosine, at.eta)));
  });
  return sum;
}

Rgb bounced_irradiance(const World& world, const Receiver& at, int samples, int bounces, std::uint64_t key) {
  const Frame frame = make_frame(at.normal);
  Rgb sum(0, 0, 0);
  for (int s = 0; s < samples; ++s) {
    const Vec3 local = sample_cosine_hemisphere(sobol_2d(static_cast<std::uint32_t>(s), key));
    if (local.z <= 0) continue;
    const Rgb radiance = trace_bounced_light(world, {at.origin, frame.to_world(local)}, bounces,
                                             hash_words(key, static_cast<std::uint64_t>(s), 1));
    sum += radiance * (kPi * (1 - fresnel_reflectance(local.z, at.eta)));
  }
  return sum / static_cast<float>(samples);
}

}  // namespace

std::vector<Rgb> compute_irradiance(const World& world, const ReceiverPoints& points, float eta, int samples,
                                    int bounces, std::uint64_t seed, Progress& progress) {
  std::vector<Rgb> irradiance(points.positions.size());
  progress.begin("computing irradiance", "samples", points.positions.size());
  parallel_for(points.positions.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3& normal = points.normals[i];
      const Receiver at{points.positions[i], normal,
                        offset_from_surface(points.positions[i], normal, points.extents[i]), eta};
      irradiance[i] = direct_irradiance(world, at, samples, hash_words(seed, i, 0));
      if (bounces > 0)
        irradiance[i] += bounced_irradiance(world, at, samples, bounces, hash_words(seed, i, 1));
    }
    progress.advance(end - begin);
  });
  progress.end();
  return irradiance;
}

}  // namespace nacre
