// Irradiance that enters a translucent object at a point.
#pragma once

#include <cstdint>

#include "nacre/transport/world.h"

namespace nacre {

/// A point on the boundary of a medium.
struct Receiver {
  Vec3 position;
  Vec3 normal;  // unit, outward
  Vec3 origin;  // just off the surface on that side (offset_from_surface)
  float eta;    // relative index of the medium
};

/// Estimates the transmitted irradiance E_t at a receiver: from every light, by `samples` connections to each
/// area light, and, with bounces, by `samples` rays for what opaque surfaces reflect. `key` chooses the
/// sequences of sample points, `first_sample` where in them to begin, so that estimates of one sample each
/// with successive numbers are as well distributed as a single one of many.
Rgb estimate_irradiance(const World& world, const Receiver& at, int samples, int bounces, std::uint64_t key,
                        std::uint32_t first_sample = 0) noexcept;

}  // namespace nacre
