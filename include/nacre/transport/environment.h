// Environment maps: radiance by direction, and directions by radiance.
#pragma once

#include "nacre/base/sampling.h"
#include "nacre/scene/scene.h"

namespace nacre {

/// An environment map made ready. The map has to outlive it unchanged.
class Environment {
 public:
  explicit Environment(const EnvironmentMap& map);
  /// Bilinear between the centres of texels, around the sides and clamped at the poles. `direction` is a unit
  /// vector.
  Rgb radiance(const Vec3& direction) const noexcept;
  /// A direction whose density is constant over each texel and in proportion to the mean radiance there; its
  /// pdf, per steradian, is above 0 wherever radiance() is. The pdf is 0 for a black map.
  Vec3 sample(const Vec2& u, float& pdf) const noexcept;
  float pdf(const Vec3& direction) const noexcept;
  /// Radiance integrated over all directions, mean of the channels.
  double total() const noexcept { return cells_.total(); }

 private:
  Vec2 to_picture(const Vec3& direction) const noexcept;  // in texels, from the upper left corner
  double cell_solid_angle(std::size_t row) const noexcept;

  const EnvironmentMap* map_;
  Vec3 axes_[3];  // of the map's own space, in world space
  Distribution2D cells_;
};

}  // namespace nacre
