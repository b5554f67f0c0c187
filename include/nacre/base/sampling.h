// Maps from uniform numbers to directions, points and distances, each with its density.
#pragma once

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "nacre/base/math.h"

namespace nacre {

/// Cosine-weighted direction around +z. Source: Shirley & Chiu 1997 (concentric map).
Vec3 sample_cosine_hemisphere(const Vec2& u) noexcept;
/// Density per steradian of sample_cosine_hemisphere; 0 below the horizon.
inline float pdf_cosine_hemisphere(float cosine) noexcept { return cosine > 0 ? cosine / kPi : 0.0f; }

/// Uniform direction on the sphere; its density is 1/(4 pi).
Vec3 sample_uniform_sphere(const Vec2& u) noexcept;
/// Uniform point of the unit disk; its density is 1/pi.
Vec2 sample_concentric_disk(const Vec2& u) noexcept;

/// Barycentric weights of a triangle's second and third vertex, uniform by area. Source: Heitz 2019.
Vec2 sample_uniform_triangle(const Vec2& u) noexcept;

/// Distance with density rate * exp(-rate t); u in [0, 1).
inline float sample_exponential(float rate, float u) noexcept { return -std::log1p(-u) / rate; }
inline float pdf_exponential(float rate, float t) noexcept { return rate * std::exp(-rate * t); }

/// Weight of a sample of density `chosen` where another way of sampling would have found it with density
/// `other`, both times their numbers of samples: the power heuristic with exponent 2, which lets the denser
/// way have nearly all. Source: Veach 1997, section 9.2.
inline float power_heuristic(float chosen, float other) noexcept {
  // By their ratio: squares of densities may overflow.
  const float ratio = other / chosen;
  return 1 / (1 + ratio * ratio);
}

/// A discrete distribution by its cumulative weights.
class Distribution {
 public:
  Distribution() = default;
  /// Weights are not negative; total() is their sum.
  explicit Distribution(std::span<const double> weights);
  double total() const noexcept { return cumulative_.empty() ? 0 : cumulative_.back(); }
  std::size_t size() const noexcept { return cumulative_.size(); }
  /// Index chosen with probability weight / total for u in [0, 1); never one of zero weight. `u` becomes the
  /// position inside the chosen interval, uniform in [0, 1) again.
  std::size_t sample(double& u) const noexcept;
  /// Probability of an index.
  double pdf(std::size_t index) const noexcept;
  std::span<const double> cumulative() const noexcept { return cumulative_; }

 private:
  std::vector<double> cumulative_;
};

/// A discrete distribution over the cells of a grid.
class Distribution2D {
 public:
  struct Cell {
    std::size_t x, y;
    double dx, dy;  // position inside the cell, uniform in [0, 1)
  };
  Distribution2D() = default;
  /// Weights, not negative, row by row of `width` cells.
  Distribution2D(std::span<const double> weights, std::size_t width);
  double total() const noexcept { return rows_.total(); }
  /// A cell chosen with probability weight / total; never one of zero weight. total() must not be zero.
  Cell sample(const Vec2& u) const noexcept;
  /// Probability of a cell.
  double pdf(std::size_t x, std::size_t y) const noexcept {
    return columns_[y].total() > 0 ? rows_.pdf(y) * columns_[y].pdf(x) : 0;
  }

 private:
  Distribution rows_;
  std::vector<Distribution> columns_;  // of each row
};

}  // namespace nacre
