// Sampling lights, and what arrives from them.
#pragma once

#include <cstdint>

#include "nacre/transport/world.h"

namespace nacre {

/// One sampled connection to a light, before visibility.
struct LightSample {
  Vec3 direction;           // unit, towards the light
  float distance = 0;       // scene units; infinite for directional lights
  Vec3 point{0, 0, 0};      // on the light; not set for directional ones
  Rgb irradiance{0, 0, 0};  // on a surface that faces the light, divided by the density of the sample
};

/// Samples light `light` as seen from x. `u` chooses a point of an area light, uniform by area, and is not
/// used by the others.
LightSample sample_light(const World& world, std::size_t light, const Vec3& x, const Vec2& u) noexcept;

/// Whether nothing lies between `origin`, a point just off a surface (offset_from_surface), and a light
/// sample taken on that surface. Always true when the world has no shadows.
bool is_visible(const World& world, const Vec3& origin, const LightSample& sample) noexcept;

/// Light that opaque surfaces reflect towards the origin of a ray after one to `bounces` bounces: what the
/// ray's first opaque hit scatters directly plus, beyond one bounce, what arrives there the same way.
/// Emission itself, which connections to lights count, is left out, and translucent surfaces reflect nothing.
/// Unbiased; one path.
Rgb trace_bounced_light(const World& world, Ray ray, int bounces, std::uint64_t key) noexcept;

/// Radiance that the diffuse part of an opaque surface sends towards direction `out` directly from all
/// lights, by `samples` connections to each; key chooses the samples.
Rgb reflect_direct_light(const World& world, const Bsdf& bsdf, const SurfacePoint& point, const Vec3& out,
                         int samples, std::uint64_t key, std::uint32_t first_sample) noexcept;

}  // namespace nacre
