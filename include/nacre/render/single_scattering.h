// Light that scatters exactly once inside a translucent object.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "nacre/cache/material_family.h"
#include "nacre/transport/world.h"

namespace nacre {

/// Samples whose way inside the object met no surface, of all that were taken.
struct LostSamples {
  std::uint64_t lost = 0, taken = 0;
};

/// First-order scattering of one medium. Source: Jensen et al. 2001, section 2.3, and Hanrahan & Krueger
/// 1993. `published` convention as printed there; `conserving` multiplies by cos(theta_i)/(eta^2
/// cos(theta_i')), so that radiance is conserved at the entry.
class SingleScattering {
 public:
  /// Of a medium of the world filled with those of a family that are wanted and have its eta, in the order in
  /// which they are wanted. The world has to outlive it.
  SingleScattering(const World& world, std::size_t medium, const MaterialFamily& family);
  SingleScattering(const World& world, std::size_t medium, const Medium& material)
      : SingleScattering(world, medium, MaterialFamily{{material}}) {}
  ~SingleScattering();
  SingleScattering(SingleScattering&&) noexcept;

  /// Estimates the radiance that leaves at `point` towards `out` (unit; the side it points to counts as
  /// outside), from `samples` points along the refracted ray, each connected to every light. The points are
  /// distributed by the mean of the three channels' free flights, cut off where the ray leaves the object;
  /// materials of nearly the same extinction share points and connections (group_by_extinction).
  /// Not negative, finite; zero where nothing enters. `key` chooses the sequence of samples and
  /// `first_sample` where in it to begin: one sample for each of successive numbers is as good as many at
  /// once.
  void estimate(const SurfacePoint& point, const Vec3& out, int samples, std::uint64_t key,
                std::uint32_t first_sample, LostSamples& lost, std::span<Rgb> radiance) const;
  /// With the first material.
  Rgb estimate(const SurfacePoint& point, const Vec3& out, int samples, std::uint64_t key,
               std::uint32_t first_sample, LostSamples& lost) const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

}  // namespace nacre
