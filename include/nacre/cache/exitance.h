// Diffuse exitance: the sum of a diffusion profile over the samples of a cache.
#pragma once

#include <cstdint>
#include <vector>

#include "nacre/cache/cache.h"
#include "nacre/cache/kernel.h"
#include "nacre/optics/medium.h"

namespace nacre {

/// One group of a cache seen with one material and one tolerance. M_o is a function of position and these
/// alone. The cache has to outlive it.
class Exitance {
 public:
  /// `tolerance` is the relative error of the sum against eval_exact; 0 sums every sample.
  Exitance(const CacheGroup& group, const Medium& medium, double tolerance);

  /// Diffuse exitance M_o = sum R_d(|x - p|) E_t(p) A_p at a point in scene units, by descent of the octree:
  /// a node stands for its samples where a second-order estimate of the error this makes is small against
  /// the whole sum. Counts evaluated nodes and samples in `evaluations`. Source: Jensen & Buhler 2002 for the
  /// hierarchy; the error estimate is nacre's own.
  Rgb eval(const Vec3& x, std::uint64_t& evaluations) const noexcept;
  /// The same sum over every sample, in octree order.
  Rgb eval_exact(const Vec3& x, std::uint64_t& evaluations) const noexcept;

 private:
  // A sample as the inner loop reads it: position and share, then E_t A.
  struct Source {
    float x, y, z, area;
    Float4 power;
  };

  Float4 guess(const Vec3& x, std::uint64_t& evaluations) const noexcept;
  Float4 sum_samples(std::size_t begin, std::size_t end, const Vec3& x) const noexcept;

  const CacheGroup& group_;
  std::vector<Source> sources_;
  Kernel kernel_;
  double allowance_;
  float nearest2_ = 0;  // squared distance within which samples are summed one by one
};

}  // namespace nacre
