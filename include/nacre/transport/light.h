// Sampling lights, and what arrives from them.
#pragma once

#include <cstdint>

#include "nacre/base/random.h"
#include "nacre/transport/world.h"

namespace nacre {

/// No surface: in a volume light counts from every side.
inline const Vec3 kNoNormal{0, 0, 0};

/// One sampled connection to a light, before visibility.
struct LightSample {
  Vec3 direction;           // unit, towards the light
  float distance = 0;       // scene units; infinite for directional lights and those all around
  Vec3 point{0, 0, 0};      // on the light; not set for those infinitely far away
  Rgb irradiance{0, 0, 0};  // on a surface that faces the light, divided by the density of the sample
  float pdf = 0;            // that density, per steradian at x; 0 for lights that is_delta()
};

/// Samples light `light` as seen from x. `u` chooses a point of an area light (sample_area_light) or a
/// direction of light from all around: a map's by its radiance, a constant light's by cosine about `normal`
/// (unit length) or uniform without one.
LightSample sample_light(const World& world, std::size_t light, const Vec3& x, const Vec2& u,
                         const Vec3& normal = kNoNormal) noexcept;

/// Density per steradian at x with which sample_light meets a hit on an area light's front; 0 elsewhere.
float pdf_light(const World& world, std::size_t light, const Vec3& x, const Hit& hit) noexcept;
/// Density per steradian at x with which sample_light takes a direction (unit length) of the light all
/// around; 0 for other lights.
float pdf_light(const World& world, std::size_t light, const Vec3& x, const Vec3& direction,
                const Vec3& normal = kNoNormal) noexcept;

/// Radiance from infinitely far away against `direction` (unit length); black in a scene without light all
/// around.
Rgb environment_radiance(const World& world, const Vec3& direction) noexcept;

/// What of a light's sample arrives.
struct Visibility {
  Rgb transmittance{1, 1, 1};
  bool through_glass = false;
};
/// What lies between `origin`, a point just off a surface (offset_from_surface), and a light sample taken on
/// that surface. Clear glass, which is a smooth dielectric without a medium, lets light through straight on,
/// less its Fresnel reflection at each boundary; everything else blocks it. Nothing does when the world has
/// no shadows.
Visibility see_light(const World& world, const Vec3& origin, const LightSample& sample);
/// From `origin` to the point of a light's sample, short of the light's own surface, or infinitely far.
Ray ray_to_light(const Vec3& origin, const LightSample& sample) noexcept;
/// Transmittance of a boundary of clear glass for a straight ray; black for any other surface.
Rgb pass_glass(const World& world, const Hit& hit, const Vec3& direction) noexcept;

/// Chooses one light by what each may send to x, judged by power, distance and direction; u in [0, 1).
LightChoice choose_light(const World& world, const Vec3& x, double u,
                         const Vec3& normal = kNoNormal) noexcept;
/// With which choose_light returns that light.
double probability_of_light(const World& world, const Vec3& x, std::size_t light,
                            const Vec3& normal = kNoNormal) noexcept;

/// Up to as many lights are all connected to; of more, as many are chosen at a time.
inline constexpr std::size_t kMaxConnectedLights = 8;

/// One of the connections whose sum is the light that arrives.
struct Connection {
  std::size_t light;
  LightSample sample;  // its irradiance is divided by the number of connections, too
  float density;  // expected number of connections per steradian: expected_connections times the sample's
                  // pdf; 0 for lights that is_delta()
};

/// How many connections for_each_connection makes to a light, on average; with pdf_light the density that
/// multiple importance sampling weighs.
float expected_connections(const World& world, std::size_t light, const Vec3& x, const Vec3& normal,
                           int samples) noexcept;

/// Light number `light`, sampled for the `index`th time, as one of so many connections on average.
Connection connect_to_light(const World& world, std::size_t light, const Vec3& x, const Vec3& normal,
                            const Vec2& u, float connections) noexcept;
/// Number `index` of `samples * kMaxConnectedLights` connections to lights that are chosen.
Connection connect_to_chosen_light(const World& world, const Vec3& x, const Vec3& normal, int samples,
                                   std::uint64_t key, std::uint32_t index) noexcept;

/// Calls visit(const Connection&) for connections to the lights, before visibility, that between them count
/// every light once: the sum of f * irradiance over them estimates the integral of f times the incoming light
/// without bias. Each light gets `samples` (at least 1) of them, one if it is_delta(); of more than
/// kMaxConnectedLights lights, samples * kMaxConnectedLights are chosen. `normal` is that of the surface at x
/// on the side that is lit, or kNoNormal. A further `first_sample` goes on where samples before it stopped.
template <class Visit>
void for_each_connection(const World& world, const Vec3& x, const Vec3& normal, int samples,
                         std::uint64_t key, std::uint32_t first_sample, const Visit& visit) {
  const auto report = [&](const Connection& connection) {
    if (!is_black(connection.sample.irradiance)) visit(connection);
  };
  const std::vector<Light>& lights = world.scene->lights;
  if (lights.size() > kMaxConnectedLights) {
    const auto count = static_cast<std::uint32_t>(samples) * static_cast<std::uint32_t>(kMaxConnectedLights);
    const std::uint32_t first = first_sample * static_cast<std::uint32_t>(kMaxConnectedLights);
    for (std::uint32_t i = 0; i < count; ++i)
      report(connect_to_chosen_light(world, x, normal, samples, key, first + i));
    return;
  }
  for (std::size_t light = 0; light < lights.size(); ++light) {
    const int count = is_delta(lights[light]) ? 1 : samples;
    for (int s = 0; s < count; ++s)
      report(connect_to_light(world, light, x, normal,
                              sobol_2d(first_sample + static_cast<std::uint32_t>(s), hash_words(key, light)),
                              static_cast<float>(count)));
  }
}

}  // namespace nacre
