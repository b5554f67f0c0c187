// Irradiance that enters a translucent object at a point.
#pragma once

#include <cstdint>
#include <span>

#include "nacre/transport/path.h"

namespace nacre {

/// A point on the boundary of a medium.
struct Receiver {
  Vec3 position;
  Vec3 normal;          // unit, outward
  Vec3 origin;          // just off the surface on that side (offset_from_surface)
  float eta;            // relative index of the medium
  Rgb albedo{1, 1, 1};  // of its surface, on the way in (surface_albedo)
};

/// Estimates the transmitted irradiance E_t at a receiver: from every light, by `samples` connections to each
/// (one if it has a single direction), and, with bounces or an answer, by `samples` rays for what opaque
/// surfaces and, if there is an `answer`, translucent ones send. Where both find a light they are weighted
/// against each other. `key` chooses the sequences of sample points, `first_sample` where in them to begin,
/// so that estimates of one sample each with successive numbers are as well distributed as a single one of
/// many.
Rgb estimate_irradiance(const World& world, const Receiver& at, int samples, int bounces, std::uint64_t key,
                        std::uint32_t first_sample = 0, const TranslucentAnswer& answer = {});

/// The same light as it enters media of several indices (that of the receiver is not used): `irradiance[i]`
/// for `etas[i]`.
void estimate_irradiances(const World& world, const Receiver& at, std::span<const float> etas, int samples,
                          int bounces, std::uint64_t key, const TranslucentAnswer& answer,
                          std::span<Rgb> irradiance);

}  // namespace nacre
