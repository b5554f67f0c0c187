// Diffuse exitance: the sum of a diffusion profile over the samples of a cache.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "nacre/cache/cache.h"
#include "nacre/cache/kernel.h"
#include "nacre/optics/medium.h"

namespace nacre {

/// One group of a cache seen with one material and one tolerance. M_o is a function of position and these
/// alone. The cache has to outlive it.
class Exitance {
 public:
  /// `tolerance` is the relative error of the sum against eval_exact, as a relative RMSE over a picture; 0
  /// sums every sample.
  Exitance(const CacheGroup& group, const Medium& medium, double tolerance);

  /// Diffuse exitance M_o = sum R_d(|x - p|) E_t(p) A_p at points in scene units. Space is divided into cells
  /// about as large as the distance of samples; all points of a cell share one list of octree nodes and
  /// samples, found by a descent in which a node stands for its samples where a second-order estimate of the
  /// error this makes is small against the whole sum. Cells are fixed in space, so that a point's value does
  /// not depend on its company; points that lie near each other are cheap. Counts evaluated nodes and samples
  /// in `evaluations`. Source: Jensen & Buhler 2002 for the hierarchy; the error estimate and the cells are
  /// nacre's own.
  void eval(std::span<const Vec3> points, std::span<Rgb> exitance, std::uint64_t& evaluations) const;
  /// The same sum over every sample, in octree order.
  void eval_exact(std::span<const Vec3> points, std::span<Rgb> exitance, std::uint64_t& evaluations) const;

 private:
  // A sample or a node as the inner loop reads it: position and share (0 for a node), then E_t A.
  struct Source {
    float x, y, z, area;
    Float4 power;
  };
  using CellIndex = std::array<std::int32_t, 3>;

  CellIndex cell_of(const Vec3& x) const noexcept;
  Float4 guess(const Vec3& centre, std::uint64_t& evaluations) const noexcept;
  void collect(const CellIndex& cell, std::vector<Source>& list, std::uint64_t& evaluations) const;
  Rgb sum(std::span<const Source> list, const Vec3& x) const noexcept;

  const CacheGroup& group_;
  std::vector<Source> sources_;
  Kernel kernel_;
  double allowance_;
  float nearest2_ = 0;  // squared distance within which samples are summed one by one
  double cell_size_ = 1;
};

}  // namespace nacre
