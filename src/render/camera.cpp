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
  // Cumulative weights of a Gaussian that is shifted to reach zero at its radius, then inverted at equal
  // steps.
  constexpr int kSteps = 4096, kEntries = 1024;
  const double sigma = film.filter_stddev, radius = radius_;
  const double floor = std::exp(-radius * radius / (2 * sigma * sigma));
  std::vector<double> cumulative(kSteps + 1, 0.0);
  for (int i = 0; i < kSteps; ++i) {
    const double x = radius * (2 * (i + 0.5) / kSteps - 1);
    cumulative[static_cast<std::size_t>(i) + 1] =
        cumulative[static_cast<std::size_t>(i)] +
        std::max(0.0, std::exp(-x * x / (2 * sigma * sigma)) - floor);
  }
  inverse_.resize(kEntries + 1);
  std::size_t step = 0;
  for (std::size_t e = 0; e <= kEntries; ++e) {
    const double wanted = cumulative.back() * static_cast<double>(e) / kEntries;
    while (step + 1 < kSteps && cumulative[step + 1] < wanted) ++step;
    const double width = cumulative[step + 1] - cumulative[step];
    const double fraction = width > 0 ? std::clamp((wanted - cumulative[step]) / width, 0.0, 1.0) : 0.0;
    inverse_[e] = static_cast<float>(radius * (2 * (static_cast<double>(step) + fraction) / kSteps - 1));
  }
}

float FilterSampler::sample_axis(float u) const noexcept {
  if (inverse_.empty()) return radius_ * (2 * u - 1);
  const float x = u * static_cast<float>(inverse_.size() - 1);
  const auto cell = std::min(static_cast<std::size_t>(x), inverse_.size() - 2);
  return inverse_[cell] + (x - static_cast<float>(cell)) * (inverse_[cell + 1] - inverse_[cell]);
}

}  // namespace nacre
