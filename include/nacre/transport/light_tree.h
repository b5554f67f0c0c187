// Choosing one of many lights by what it may send to a point.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "nacre/base/math.h"

namespace nacre {

/// What is known of a light, or of a group of them, without looking closer.
struct LightBound {
  Box3 box;
  double intensity = 0;      // towards where it sends most, per steradian; mean of the channels
  Vec3 axis{0, 0, 1};        // mean of its normals
  float normal_angle = kPi;  // largest between a normal and the axis; pi: unknown
  // Of the largest angle between light that leaves and the normal of where it leaves: with 0 it fades like a
  // cosine, with more not at all.
  float beam_cosine = 1;
  float normal_cosine = -1, normal_sine = 0;  // of normal_angle; the tree sets them
};

struct LightChoice {
  std::size_t light = 0;
  double probability = 0;  // 0: no light can reach the point
};

/// A binary tree of bounds over lights of finite distance. Source: Conty & Kulla 2018, "Importance sampling
/// of many lights with adaptive tree splitting" (bounds and importance; the tree is split at medians).
class LightTree {
 public:
  LightTree() = default;
  /// `lights[i]` is the number by which the light of bounds[i] is called, below `light_count`.
  LightTree(std::span<const LightBound> bounds, std::span<const std::size_t> lights, std::size_t light_count);

  /// About the irradiance that all of them send to x; 0 only if none of them can. `normal` is that of a
  /// surface that is lit, of unit length, or zero: then light counts from everywhere.
  double importance(const Vec3& x, const Vec3& normal) const noexcept;
  /// Chooses a light by u in [0, 1).
  LightChoice choose(const Vec3& x, const Vec3& normal, double u) const noexcept;
  /// With which choose() returns that light of the tree.
  double probability(std::size_t light, const Vec3& x, const Vec3& normal) const noexcept;

 private:
  struct Node {
    LightBound bound;
    std::uint32_t second = 0;  // child; the first one is the next node. 0: a leaf
    std::uint32_t light = 0;   // of a leaf
  };
  std::uint32_t build(std::span<std::uint32_t> items, std::span<const LightBound> bounds,
                      std::span<const std::size_t> lights, std::uint64_t path, int depth);
  double first_probability(const Node& node, const Vec3& x, const Vec3& normal) const noexcept;

  std::vector<Node> nodes_;
  std::vector<std::uint64_t>
      paths_;  // by light: bit k says whether its leaf is below the second child at depth k
};

}  // namespace nacre
