// The brute-force estimate of diffusion, without a cache: what the hierarchical sum is judged by.
#pragma once

#include <cstdint>
#include <memory>

#include "nacre/transport/world.h"

namespace nacre {

/// How surface points are chosen. kUniform: by area. kExponential: by distance, with densities
/// rate exp(-rate d)/(2 pi d) on discs around the point, along three axes (the normal half of the time, two
/// tangents a quarter each), every surface above or below the disc counting; the rates are sigma_tr and 1/l'
/// of the three channels. Sources: Gibbs 2018; King et al. 2013, "BSSRDF importance sampling".
enum class MonteCarloSampling { kUniform, kExponential };

/// Diffuse exitance M_o of one medium by sampling its surface and the irradiance there.
class MonteCarloDiffusion {
 public:
  /// Of a medium of the scene filled with `material`, whose eta is the scene's; `bounces` of light off opaque
  /// surfaces before it enters, as in a bake. The world has to outlive it.
  MonteCarloDiffusion(const World& world, std::size_t medium, const Medium& material,
                      MonteCarloSampling sampling, int bounces);
  ~MonteCarloDiffusion();
  MonteCarloDiffusion(MonteCarloDiffusion&&) noexcept;

  /// Unbiased estimate of M_o at a point of the medium's surface from `samples` surface points (or probe
  /// rays), with one connection to each light from every one of them. `key` and `first_sample` as in
  /// estimate_irradiance.
  Rgb estimate(const SurfacePoint& point, int samples, std::uint64_t key, std::uint32_t first_sample) const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

}  // namespace nacre
