// Perspective projection; inversion of filters.
#include "nacre/render/camera.h"

namespace nacre {
namespace {

// Half extents of the picture on the plane at distance 1.
Vec2 half_extents(const Camera& camera, double width, double height) {
  const double half = std::tan(camera.fov * kPiD / 360);
  const double aspect = width / height;
  const bool along_x = camera.fov_axis == FovAxis::kX ||
                       (camera.fov_axis == FovAxis::kSmaller && aspect <= 1) ||
                       (camera.fov_axis == FovAxis::kLarger && aspect >= 1);
  double x = half;
  if (camera.fov_axis == FovAxis::kDiagonal)
    x = half * aspect / std::sqrt(1 + aspect * aspect);
  else if (!along_x)
    x = half * aspect;
  return {static_cast<float>(x), static_cast<float>(x / aspect)};
}

Vec3 transform_direction(const Matrix4& m, const Vec3d& v) {
  Vec3d result;
  m.multDirMatrix(v, result);
  return Vec3(result);
}

}  // namespace

CameraRays::CameraRays(const Camera& camera, int width, int height)
    : near_(camera.near_clip), far_(camera.far_clip) {
  const Vec2 half = half_extents(camera, width, height);
  origin_ = Vec3(camera.to_world.translation());
  // Scale in the transform changes neither angles nor clip distances.
  axis_ = transform_direction(camera.to_world, {0, 0, 1}).normalized();
  // The camera's +x points to the left of the picture, so that pixels go towards -x; a mirroring transform
  // keeps that.
  const Vec3 left = transform_direction(camera.to_world, {1, 0, 0}).normalized() * half.x;
  const Vec3 up = transform_direction(camera.to_world, {0, 1, 0}).normalized() * half.y;
  corner_ = axis_ + left + up;
  right_ = left * (-2.0f / static_cast<float>(width));
  down_ = up * (-2.0f / static_cast<float>(height));
}

Ray CameraRays::at(const Vec2& pixel) const noexcept {
  const Vec3 direction = (corner_ + right_ * pixel.x + down_ * pixel.y).normalized();
  const float to_planes = 1 / dot(direction, axis_);
  return {origin_, direction, near_ * to_planes, far_ * to_planes};
}

FilterSampler::FilterSampler(const Film& film) : radius_(film.filter_radius) {
  if (film.filter == FilterKind::kBox) return;
  // A Gaussian that is shifted to reach zero at its radius, in steps so short that its weight hardly changes
  // within one.
  constexpr std::size_t kSteps = 4096;
  const double sigma = film.filter_stddev, radius = radius_;
  const auto gaussian = [&](double x) { return std::exp(-x * x / (2 * sigma * sigma)); };
  std::vector<double> weights(kSteps);
  for (std::size_t i = 0; i < kSteps; ++i) {
    const double x = radius * (2 * (static_cast<double>(i) + 0.5) / kSteps - 1);
    weights[i] = std::max(0.0, gaussian(x) - gaussian(radius));
  }
  steps_ = Distribution(weights);
}

float FilterSampler::sample_axis(float u) const noexcept {
  if (!(steps_.total() > 0)) return radius_ * (2 * u - 1);
  double within = u;
  const std::size_t step = steps_.sample(within);
  const double x = (static_cast<double>(step) + within) / static_cast<double>(steps_.size());
  return static_cast<float>(radius_ * (2 * x - 1));
}

}  // namespace nacre
