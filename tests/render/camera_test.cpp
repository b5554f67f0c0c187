// label: analytic
// Camera rays against projections worked out by hand; filters by chi-square.
#include "nacre/render/camera.h"

#include <gtest/gtest.h>

#include "base/statistics.h"
#include "nacre/base/random.h"

namespace nacre {
namespace {

void expect_direction(const Ray& ray, const Vec3& expected) {
  EXPECT_NEAR((ray.direction - expected.normalized()).length(), 0, 1e-5);
}

// Untransformed, the camera looks along +z with +x to the left of the picture and +y up.
TEST(CameraRays, FollowMitsubasAxes) {
  Camera camera;
  camera.fov = 90;
  const CameraRays rays(camera, 200, 100);
  expect_direction(rays.at({100, 50}), {0, 0, 1});
  expect_direction(rays.at({0, 50}), {1, 0, 1});
  expect_direction(rays.at({200, 50}), {-1, 0, 1});
  expect_direction(rays.at({100, 0}), {0, 0.5f, 1});
}

TEST(CameraRays, FieldOfViewAxes) {
  const auto half_width = [](FovAxis axis, int width, int height) {
    Camera camera;
    camera.fov = 90;
    camera.fov_axis = axis;
    const Ray ray = CameraRays(camera, width, height).at({0, static_cast<float>(height) / 2});
    return ray.direction.x / ray.direction.z;
  };
  EXPECT_NEAR(half_width(FovAxis::kX, 200, 100), 1, 1e-5);
  EXPECT_NEAR(half_width(FovAxis::kY, 200, 100), 2, 1e-5);
  EXPECT_NEAR(half_width(FovAxis::kSmaller, 200, 100), 2, 1e-5);
  EXPECT_NEAR(half_width(FovAxis::kLarger, 200, 100), 1, 1e-5);
  EXPECT_NEAR(half_width(FovAxis::kSmaller, 100, 200), 1, 1e-5);
  EXPECT_NEAR(half_width(FovAxis::kDiagonal, 200, 100), 2 / std::sqrt(5.0), 1e-5);
}

TEST(CameraRays, ClipAtPlanesNotSpheres) {
  Camera camera;
  camera.fov = 90;
  camera.near_clip = 2;
  camera.far_clip = 50;
  const Ray ray = CameraRays(camera, 100, 100).at({0, 50});
  EXPECT_NEAR(ray.t_min, 2 * std::sqrt(2.0f), 1e-4);
  EXPECT_NEAR(ray.t_max, 50 * std::sqrt(2.0f), 1e-3);
}

TEST(FilterSampler, FollowsItsFilter) {
  for (const FilterKind kind : {FilterKind::kBox, FilterKind::kGaussian}) {
    Film film;
    film.filter = kind;
    film.filter_radius = kind == FilterKind::kBox ? 0.5f : 2.0f;
    film.filter_stddev = 0.6f;
    const FilterSampler filter(film);
    constexpr int kCells = 40, kSamples = 200000;
    std::vector<double> x(kCells, 0.0), y(kCells, 0.0), expected(kCells, 0.0);
    Rng rng(9);
    const double radius = film.filter_radius;
    const auto cell = [&](double offset) {
      return static_cast<std::size_t>(std::clamp((offset / radius + 1) / 2 * kCells, 0.0, kCells - 1.0));
    };
    for (int i = 0; i < kSamples; ++i) {
      const Vec2 offset = filter.sample(rng.next_2d());
      ASSERT_LE(std::abs(offset.x), radius);
      x[cell(offset.x)] += 1;
      y[cell(offset.y)] += 1;
    }
    double norm = 0;
    for (int i = 0; i < kCells * 64; ++i) {
      const double at = radius * (2 * (i + 0.5) / (kCells * 64) - 1);
      const auto gaussian = [&](double d) { return std::exp(-d * d / (2 * 0.36)); };
      const double weight = kind == FilterKind::kBox ? 1 : std::max(0.0, gaussian(at) - gaussian(radius));
      expected[static_cast<std::size_t>(i / 64)] += weight;
      norm += weight;
    }
    for (double& e : expected) e *= kSamples / norm;
    EXPECT_GT(testing_support::chi_square_p(x, expected), 1e-4);
    EXPECT_GT(testing_support::chi_square_p(y, expected), 1e-4);
  }
}

}  // namespace
}  // namespace nacre
