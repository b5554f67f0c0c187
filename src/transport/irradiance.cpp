// Direct and bounced light through a smooth boundary.
#include "nacre/transport/irradiance.h"

#include <algorithm>

#include "nacre/base/random.h"
#include "nacre/base/sampling.h"
#include "nacre/optics/fresnel.h"
#include "nacre/transport/light.h"

namespace nacre {
namespace {

// Calls add(light, cosine) for all that arrives: perpendicular irradiance times the cosine. By connections;
// where rays look for lights as well, weighted against `rays` of them.
template <class Add>
void connect_lights(const World& world, const Receiver& at, int samples, int rays, std::uint64_t key,
                    std::uint32_t first_sample, const Add& add) {
  for_each_connection(
      world, at.position, at.normal, samples, key, first_sample, [&](const Connection& connection) {
        const LightSample& light = connection.sample;
        const float cosine = dot(light.direction, at.normal);
        if (cosine <= 0) return;
        float weight = 1;
        if (connection.density > 0)
          weight = connection_weight(light.pdf, connection.density,
                                     static_cast<float>(rays) * pdf_cosine_hemisphere(cosine), {});
        if (weight == 0 && !world.has_glass) return;
        const Visibility visibility = see_light(world, at.origin, light);
        if (is_black(visibility.transmittance)) return;
        add(light.irradiance * visibility.transmittance *
                ((visibility.through_glass ? 1.0f : weight) * cosine),
            cosine);
      });
}

template <class Add>
void gather_light(const World& world, const Receiver& at, int samples, int bounces, std::uint64_t key,
                  std::uint32_t first_sample, const TranslucentAnswer& answer, const Add& add) {
  const Frame frame = make_frame(at.normal);
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
    const Rgb light = trace_light(world, ray, bounces, hash_words(key, index, 1), answer);
    if (!is_black(light)) add(light * (kPi / static_cast<float>(samples)), local.z);
  }
}

template <class Add>
void receive_light(const World& world, const Receiver& at, int samples, int bounces, std::uint64_t key,
                   std::uint32_t first_sample, const TranslucentAnswer& answer, const Add& add) {
  const bool gathers = bounces > 0 || answer;
  const int rays = gathers && world.shadows ? samples : 0;
  connect_lights(world, at, samples, rays, hash_words(key, 0), first_sample, add);
  if (gathers) gather_light(world, at, samples, bounces, hash_words(key, 1), first_sample, answer, add);
}

float transmittance(float cosine, float eta) { return 1 - fresnel_reflectance(std::min(cosine, 1.0f), eta); }

}  // namespace

Rgb estimate_irradiance(const World& world, const Receiver& at, int samples, int bounces, std::uint64_t key,
                        std::uint32_t first_sample, const TranslucentAnswer& answer) {
  Rgb sum(0, 0, 0);
  receive_light(world, at, samples, bounces, key, first_sample, answer,
                [&](const Rgb& light, float cosine) { sum += light * transmittance(cosine, at.eta); });
  return sum * at.albedo;
}

void estimate_irradiances(const World& world, const Receiver& at, std::span<const float> etas, int samples,
                          int bounces, std::uint64_t key, const TranslucentAnswer& answer,
                          std::span<Rgb> irradiance) {
  std::ranges::fill(irradiance, Rgb(0, 0, 0));
  receive_light(world, at, samples, bounces, key, 0, answer, [&](const Rgb& light, float cosine) {
    for (std::size_t i = 0; i < etas.size(); ++i) irradiance[i] += light * transmittance(cosine, etas[i]);
  });
  for (Rgb& value : irradiance) value *= at.albedo;
}

}  // namespace nacre
