// Projections; inversion of filters.
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

// Source: Mitchell & Netravali 1988, for |x| from 0 to 2 and without the factor 1/6.
double mitchell(double x, double b, double c) {
  x = std::abs(x);
  if (x >= 2) return 0;
  if (x < 1) return ((12 - 9 * b - 6 * c) * x + (-18 + 12 * b + 6 * c)) * x * x + (6 - 2 * b);
  return (((-b - 6 * c) * x + (6 * b + 30 * c)) * x + (-12 * b - 48 * c)) * x + (8 * b + 24 * c);
}

double eval_filter(const Film& film, double x) {
  const double radius = film.filter_radius;
  switch (film.filter) {
    case FilterKind::kBox:
      return 1;
    case FilterKind::kTent:
      return 1 - std::abs(x) / radius;
    case FilterKind::kMitchell:
      return mitchell(2 * x / radius, film.filter_b, film.filter_c);
    case FilterKind::kGaussian:
      break;
  }
  // Shifted to reach zero at its radius.
  const double scale = -0.5 / (double{film.filter_stddev} * film.filter_stddev);
  return std::max(0.0, std::exp(scale * x * x) - std::exp(scale * radius * radius));
}

}  // namespace

CameraRays::CameraRays(const Camera& camera, int width, int height)
    : parallel_(camera.kind == CameraKind::kOrthographic),
      origin_(camera.to_world.translation()),
      axis_(transform_direction(camera.to_world, {0, 0, 1}).normalized()),
      inverse_focus_distance_(1 / camera.focus_distance),
      near_(camera.near_clip),
      far_(camera.far_clip) {
  // The camera's +x points to the left of the picture, so that pixels go towards -x; a mirroring transform
  // keeps that.
  Vec3 left = transform_direction(camera.to_world, {1, 0, 0});
  Vec3 up = transform_direction(camera.to_world, {0, 1, 0});
  if (parallel_) {
    up *= static_cast<float>(height) / static_cast<float>(width);
    corner_ = origin_ + left + up;
  } else {
    // Scale in the transform changes neither angles nor clip distances.
    left.normalize();
    up.normalize();
    const float radius = camera.kind == CameraKind::kThinLens ? camera.aperture_radius : 0;
    lens_left_ = left * radius;
    lens_up_ = up * radius;
    const Vec2 half = half_extents(camera, width, height);
    left *= half.x;
    up *= half.y;
    corner_ = axis_ + left + up;
  }
  right_ = left * (-2.0f / static_cast<float>(width));
  down_ = up * (-2.0f / static_cast<float>(height));
}

Ray CameraRays::at(const Vec2& pixel, const Vec2& lens) const noexcept {
  const Vec3 across = corner_ + right_ * pixel.x + down_ * pixel.y;
  if (parallel_) return {across, axis_, near_, far_};
  // Through the point at the focus distance that the middle of the lens sees in this direction.
  const Vec2 disk = sample_concentric_disk(lens);
  const Vec3 start = lens_left_ * disk.x + lens_up_ * disk.y;
  const Vec3 direction = (across - start * inverse_focus_distance_).normalized();
  const float to_planes = 1 / dot(direction, axis_);
  return {origin_ + start, direction, near_ * to_planes, far_ * to_planes};
}

FilterSampler::FilterSampler(const Film& film) : radius_(film.filter_radius) {
  if (film.filter == FilterKind::kBox) return;
  // Steps so short that the weight hardly changes within one.
  constexpr std::size_t kSteps = 4096;
  std::vector<double> magnitudes(kSteps);
  negative_.resize(kSteps);
  double sum = 0;
  for (std::size_t i = 0; i < kSteps; ++i) {
    const double value =
        eval_filter(film, film.filter_radius * (2 * (static_cast<double>(i) + 0.5) / kSteps - 1));
    sum += value;
    magnitudes[i] = std::abs(value);
    negative_[i] = value < 0;
  }
  if (!(sum > 0)) return;  // narrower than rounding: as good as a box
  steps_ = Distribution(magnitudes);
  weight_ = static_cast<float>(steps_.total() / sum);
}

FilterSample FilterSampler::sample(const Vec2& u) const noexcept {
  const AxisSample x = sample_axis(u.x), y = sample_axis(u.y);
  return {{x.offset, y.offset}, x.weight * y.weight};
}

FilterSampler::AxisSample FilterSampler::sample_axis(float u) const noexcept {
  if (steps_.size() == 0) return {radius_ * (2 * u - 1), 1};
  double within = u;
  const std::size_t step = steps_.sample(within);
  const double x = (static_cast<double>(step) + within) / static_cast<double>(steps_.size());
  return {static_cast<float>(radius_ * (2 * x - 1)), negative_[step] ? -weight_ : weight_};
}

}  // namespace nacre
