// Camera rays and reconstruction filters.
#pragma once

#include "nacre/base/sampling.h"
#include "nacre/geometry/ray_tracer.h"
#include "nacre/scene/scene.h"

namespace nacre {

/// A perspective camera made ready for one picture size.
class CameraRays {
 public:
  CameraRays(const Camera& camera, int width, int height);
  /// Ray through a point of the picture in pixels, (0, 0) the top left corner; unit direction, clipped at the
  /// near and far planes.
  Ray at(const Vec2& pixel) const noexcept;

 private:
  Vec3 origin_, corner_, right_, down_, axis_;
  float near_, far_;
};

/// Draws offsets from a pixel's centre with the density of a reconstruction filter, so that pixels are plain
/// means of their own samples. Separable; by tabulated inversion.
class FilterSampler {
 public:
  explicit FilterSampler(const Film& film);
  Vec2 sample(const Vec2& u) const noexcept { return {sample_axis(u.x), sample_axis(u.y)}; }

 private:
  float sample_axis(float u) const noexcept;
  float radius_;
  Distribution steps_;  // weights of short steps from -radius to radius; empty for a box
};

}  // namespace nacre
