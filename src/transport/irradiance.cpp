// Direct and bounced light through a smooth boundary.
#include "nacre/transport/irradiance.h"

#include "nacre/base/random.h"
#include "nacre/base/sampling.h"
#include "nacre/optics/fresnel.h"
#include "nacre/transport/light.h"

namespace nacre {
namespace {

Rgb direct_irradiance(const World& world, const Receiver& at, int samples, std::uint64_t key,
                      std::uint32_t first_sample) {
  Rgb sum(0, 0, 0);
  for_each_connection(
      world, at.position, at.normal, samples, key, first_sample, [&](const Connection& connection) {
        const LightSample& sample = connection.sample;
        const float cosine = dot(sample.direction, at.normal);
        if (cosine > 0 && is_visible(world, at.origin, sample))
          sum += sample.irradiance * (cosine * (1 - fresnel_reflectance(std::min(cosine, 1.0f), at.eta)));
      });
  return sum;
}

Rgb bounced_irradiance(const World& world, const Receiver& at, int samples, int bounces, std::uint64_t key,
                       std::uint32_t first_sample) {
  const Frame frame = make_frame(at.normal);
  Rgb sum(0, 0, 0);
  for (int s = 0; s < samples; ++s) {
    const std::uint32_t index = first_sample + static_cast<std::uint32_t>(s);
    const Vec3 local = sample_cosine_hemisphere(sobol_2d(index, key));
    if (local.z <= 0) continue;
    const Rgb radiance =
        trace_bounced_light(world, {at.origin, frame.to_world(local)}, bounces, hash_words(key, index, 1));
    sum += radiance * (kPi * (1 - fresnel_reflectance(local.z, at.eta)));
  }
  return sum / static_cast<float>(samples);
}

}  // namespace

Rgb estimate_irradiance(const World& world, const Receiver& at, int samples, int bounces, std::uint64_t key,
                        std::uint32_t first_sample) noexcept {
  Rgb sum = direct_irradiance(world, at, samples, hash_words(key, 0), first_sample);
  if (bounces > 0) sum += bounced_irradiance(world, at, samples, bounces, hash_words(key, 1), first_sample);
  return sum;
}

}  // namespace nacre
