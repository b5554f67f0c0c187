// Direct and bounced light through a smooth boundary.
#include "nacre/transport/irradiance.h"

#include "nacre/base/random.h"
#include "nacre/base/sampling.h"
#include "nacre/optics/fresnel.h"
#include "nacre/transport/light.h"

namespace nacre {
namespace {

float transmittance(const Receiver& at, float cosine) {
  return 1 - fresnel_reflectance(std::min(cosine, 1.0f), at.eta);
}

// By connections; where rays look for lights as well, weighted against `rays` of them by the power
// heuristic.
Rgb connected_irradiance(const World& world, const Receiver& at, int samples, int rays, std::uint64_t key,
                         std::uint32_t first_sample) {
  Rgb sum(0, 0, 0);
  for_each_connection(
      world, at.position, at.normal, samples, key, first_sample, [&](const Connection& connection) {
        const LightSample& light = connection.sample;
        const float cosine = dot(light.direction, at.normal);
        if (cosine <= 0) return;
        const Visibility visibility = see_light(world, at.origin, light);
        float weight = 1;
        if (connection.density > 0 && !visibility.through_glass)
          weight =
              power_heuristic(connection.density, static_cast<float>(rays) * pdf_cosine_hemisphere(cosine));
        sum += light.irradiance * visibility.transmittance * (weight * cosine * transmittance(at, cosine));
      });
  return sum;
}

Rgb gathered_irradiance(const World& world, const Receiver& at, int samples, int bounces, std::uint64_t key,
                        std::uint32_t first_sample, const TranslucentAnswer& answer) {
  const Frame frame = make_frame(at.normal);
  Rgb sum(0, 0, 0);
  for (int s = 0; s < samples; ++s) {
    const std::uint32_t index = first_sample + static_cast<std::uint32_t>(s);
    const Vec3 local = sample_cosine_hemisphere(sobol_2d(index, key));
    if (local.z <= 0) continue;
    PathRay ray;
    ray.ray = {at.origin, frame.to_world(local)};
    ray.emission = world.shadows;
    ray.density = static_cast<float>(samples) * pdf_cosine_hemisphere(local.z);
    ray.position = at.position;
    ray.normal = at.normal;
    ray.light_samples = samples;
    sum += trace_light(world, ray, bounces, hash_words(key, index, 1), answer) *
           (kPi * transmittance(at, local.z));
  }
  return sum / static_cast<float>(samples);
}

}  // namespace

Rgb estimate_irradiance(const World& world, const Receiver& at, int samples, int bounces, std::uint64_t key,
                        std::uint32_t first_sample, const TranslucentAnswer& answer) {
  const bool gathers = bounces > 0 || answer;
  const int rays = gathers && world.shadows ? samples : 0;
  Rgb sum = connected_irradiance(world, at, samples, rays, hash_words(key, 0), first_sample);
  if (gathers)
    sum += gathered_irradiance(world, at, samples, bounces, hash_words(key, 1), first_sample, answer);
  return sum * at.albedo;
}

}  // namespace nacre
