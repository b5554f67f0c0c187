// Camera rays and reconstruction filters.
#pragma once

#include "nacre/base/sampling.h"
#include "nacre/geometry/ray_tracer.h"
#include "nacre/scene/scene.h"

namespace nacre {

/// A camera made ready for one picture size.
class CameraRays {
 public:
  CameraRays(const Camera& camera, int width, int height);
  /// Ray through a point of the picture in pixels, (0, 0) the top left corner; unit direction, clipped at the
  /// near and far planes. `lens`, in [0, 1)^2, says where on the lens it starts; only kThinLens has one.
  Ray at(const Vec2& pixel, const Vec2& lens) const noexcept;

 private:
  bool parallel_;
  Vec3 origin_, axis_;
  Vec3 corner_, right_, down_;  // of the picture: directions at distance 1, or starting points if parallel
  Vec3 lens_left_, lens_up_;    // radii of the lens
  float inverse_focus_distance_;
  float near_, far_;
};

/// Where in a pixel's neighbourhood a sample is taken, and what it counts.
struct FilterSample {
  Vec2 offset;   // from the pixel's centre
  float weight;  // 1 on average; -1 times a constant where the filter is negative
};

/// Draws offsets from a pixel's centre with the density of a reconstruction filter's magnitude, so that
/// pixels are plain means of their own weighted samples. Separable; by tabulated inversion.
class FilterSampler {
 public:
  explicit FilterSampler(const Film& film);
  FilterSample sample(const Vec2& u) const noexcept;

 private:
  struct AxisSample {
    float offset, weight;
  };
  AxisSample sample_axis(float u) const noexcept;

  float radius_;
  float weight_ = 1;            // integral of |filter| over that of the filter, along one axis
  Distribution steps_;          // |weights| of short steps from -radius to radius; empty for a box
  std::vector<bool> negative_;  // which of them are negative
};

}  // namespace nacre
