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

  /// Diffuse exitance M_o = sum R_d(|x - p|) E_t(p) A_p at points in scene units. Space is divided into
  /// blocks, those into cells, down to a few distances of samples. A node of the octree stands for its
  /// samples, and its contribution to a block or cell is a Taylor series of second order around its centre,
  /// where an estimate of both errors is small against the whole sum; what is too near for a block is left to
  /// its parts, and in a cell summed point by point. Blocks and cells are fixed in space, so that a point's
  /// value does not depend on its company; points that lie near each other are cheap. Counts evaluations of
  /// R_d in `evaluations`. Source: Jensen & Buhler 2002 for the hierarchy, Greengard & Rokhlin 1987 for the
  /// expansions; the error estimates and the cells are nacre's own.
  void eval(std::span<const Vec3> points, std::span<Rgb> exitance, std::uint64_t& evaluations,
            int leaf_level = kLeafLevel) const;
  /// Cells that are divided no further have sides of 2^`leaf_level` * kCellSpacings spacings of the samples.
  /// The default is for points about as dense as samples; where there are more, smaller cells are cheaper.
  static constexpr int kLeafLevel = 2;
  /// The cheapest level for `points` evenly spread over the surface.
  int leaf_level_for(double points) const noexcept;
  /// The same sum over every sample, in octree order.
  void eval_exact(std::span<const Vec3> points, std::span<Rgb> exitance, std::uint64_t& evaluations) const;

  /// The cell of a point, in Morton order: points of one cell, and cells of one block, follow each other.
  std::uint64_t cell_code(const Vec3& x) const noexcept;

 private:
  static constexpr double kCellSpacings = 0.75;  // side of the smallest cells
  static constexpr int kBlockLevels = 5;         // a block has 32 of them along each side
  static std::uint64_t block_of(std::uint64_t cell_code) noexcept { return cell_code >> 3 * kBlockLevels; }

  // A sample or a node as the inner loop reads it: position and share (0 for a node), then E_t A.
  struct Source {
    float x, y, z, area;
    Float4 power;
  };
  struct Point {
    std::uint64_t code;
    std::uint32_t index;
  };
  struct Target;
  struct Room;

  bool in_grid(const Vec3& x) const noexcept;
  Float4 guess(const Vec3& centre, std::uint64_t& evaluations) const noexcept;
  void eval_target(std::span<const Point> range, int level, const Target* parent, Room& room) const;
  Rgb sum(std::span<const Source> list, const Vec3& x) const noexcept;

  const CacheGroup& group_;
  std::vector<Source> sources_;
  Kernel kernel_;
  double allowance_;
  float nearest2_ = 0;     // squared distance within which samples are summed one by one
  Vec3d origin_{0, 0, 0};  // corner of the first cell
  double cell_size_ = 1;
};

}  // namespace nacre
