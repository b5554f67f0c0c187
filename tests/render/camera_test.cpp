// label: analytic
// Camera rays against projections worked out by hand; filters by chi-square.
#include "nacre/render/camera.h"

#include <gtest/gtest.h>

#include "base/statistics.h"
#include "nacre/base/random.h"

namespace nacre {
namespace {

const Vec2 kLensCentre{0.5f, 0.5f};

void expect_direction(const Ray& ray, const Vec3& expected) {
  EXPECT_NEAR((ray.direction - expected.normalized()).length(), 0, 1e-5);
}

// Untransformed, the camera looks along +z with +x to the left of the picture and +y up.
TEST(CameraRays, FollowMitsubasAxes) {
  Camera camera;
  camera.fov = 90;
  const CameraRays rays(camera, 200, 100);
  expect_direction(rays.at({100, 50}, kLensCentre), {0, 0, 1});
  expect_direction(rays.at({0, 50}, kLensCentre), {1, 0, 1});
  expect_direction(rays.at({200, 50}, kLensCentre), {-1, 0, 1});
  expect_direction(rays.at({100, 0}, kLensCentre), {0, 0.5f, 1});
}

TEST(CameraRays, FieldOfViewAxes) {
  const auto half_width = [](FovAxis axis, int width, int height) {
    Camera camera;
    camera.fov = 90;
    camera.fov_axis = axis;
    const Ray ray = CameraRays(camera, width, height).at({0, static_cast<float>(height) / 2}, kLensCentre);
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
  const Ray ray = CameraRays(camera, 100, 100).at({0, 50}, kLensCentre);
  EXPECT_NEAR(ray.t_min, 2 * std::sqrt(2.0f), 1e-4);
  EXPECT_NEAR(ray.t_max, 50 * std::sqrt(2.0f), 1e-3);
}

// All rays through one point of the picture meet at the focus distance, and fill the lens evenly.
TEST(CameraRays, ThinLensIsSharpAtItsFocusDistance) {
  Camera camera;
  camera.kind = CameraKind::kThinLens;
  camera.fov = 90;
  camera.aperture_radius = 0.5f;
  camera.focus_distance = 8;
  camera.near_clip = 1;
  camera.far_clip = 20;
  camera.to_world.setTranslation(Vec3d(1, 2, 3));
  const CameraRays rays(camera, 200, 100);
  Rng rng(4);
  double radius2 = 0;
  Vec3d middle(0);
  constexpr int kSamples = 20000;
  for (int i = 0; i < kSamples; ++i) {
    const Ray ray = rays.at({0, 50}, rng.next_2d());
    EXPECT_NEAR(ray.origin.z, 3, 1e-6);
    const Vec3 from_axis = ray.origin - Vec3(1, 2, 3);
    ASSERT_LE(from_axis.length(), 0.5f * 1.00001f);
    radius2 += from_axis.length2() / kSamples;
    middle += Vec3d(from_axis) / kSamples;
    const Vec3 sharp = ray.origin + ray.direction * (8 / ray.direction.z);
    EXPECT_NEAR((sharp - Vec3(9, 2, 11)).length(), 0, 2e-5);
    EXPECT_NEAR(ray.direction.length(), 1, 1e-6);
    EXPECT_NEAR(ray.t_min * ray.direction.z, 1, 1e-5);
    EXPECT_NEAR(ray.t_max * ray.direction.z, 20, 1e-4);
  }
  EXPECT_NEAR(radius2, 0.125, 0.125 * 0.02);
  EXPECT_NEAR(middle.length(), 0, 0.01);
}

TEST(CameraRays, ThinLensAtItsMiddleIsAPinhole) {
  Camera camera;
  const Ray pinhole = CameraRays(camera, 64, 48).at({10, 7}, {0.1f, 0.9f});
  camera.kind = CameraKind::kThinLens;
  camera.aperture_radius = 3;
  const Ray lens = CameraRays(camera, 64, 48).at({10, 7}, kLensCentre);
  EXPECT_EQ(lens.origin, pinhole.origin);
  EXPECT_EQ(lens.direction, pinhole.direction);
}

// x from -1 to 1, +x to the left; y by the picture's shape; scale enlarges what is seen, not the distances.
TEST(CameraRays, OrthographicShowsItsScale) {
  Camera camera;
  camera.kind = CameraKind::kOrthographic;
  camera.near_clip = 0.5f;
  camera.far_clip = 30;
  const Ray corner = CameraRays(camera, 200, 100).at({0, 0}, kLensCentre);
  EXPECT_EQ(corner.origin, Vec3(1, 0.5f, 0));
  EXPECT_EQ(corner.direction, Vec3(0, 0, 1));
  camera.to_world.setScale(Vec3d(3, 5, 7));
  camera.to_world *= Matrix4().setTranslation(Vec3d(10, 20, 30));
  const CameraRays rays(camera, 200, 100);
  for (const auto& [pixel, origin] : {std::pair{Vec2(0, 0), Vec3(13, 22.5f, 30)},
                                      {Vec2(200, 100), Vec3(7, 17.5f, 30)},
                                      {Vec2(100, 50), Vec3(10, 20, 30)}}) {
    const Ray ray = rays.at(pixel, {0.2f, 0.8f});
    EXPECT_NEAR((ray.origin - origin).length(), 0, 1e-5);
    EXPECT_EQ(ray.direction, Vec3(0, 0, 1));
    EXPECT_EQ(ray.t_min, 0.5f);
    EXPECT_EQ(ray.t_max, 30);
  }
}

Film film_with(FilterKind kind) {
  Film film;
  film.filter = kind;
  film.filter_stddev = 0.6f;
  film.filter_radius = kind == FilterKind::kBox ? 0.5f : kind == FilterKind::kTent ? 1.0f : 2.0f;
  return film;
}

constexpr FilterKind kFilters[] = {FilterKind::kBox, FilterKind::kTent, FilterKind::kGaussian,
                                   FilterKind::kMitchell};

// Written down once more, without the terms that the code sums by Horner's rule: with B = C = 1/3.
double filter_at(FilterKind kind, double x) {
  x = std::abs(x);
  const auto gaussian = [](double d) { return std::exp(-d * d / (2 * 0.36)); };
  if (kind == FilterKind::kBox) return 1;
  if (kind == FilterKind::kTent) return 1 - x;
  if (kind == FilterKind::kGaussian) return std::max(0.0, gaussian(x) - gaussian(2));
  return x < 1 ? 7 / 6. * x * x * x - 2 * x * x + 8 / 9.
               : -7 / 18. * x * x * x + 2 * x * x - 10 / 3. * x + 16 / 9.;
}

// Histograms of the weights of both axes, against the filter itself: counts against its magnitude.
TEST(FilterSampler, FollowsItsFilter) {
  for (const FilterKind kind : kFilters) {
    const Film film = film_with(kind);
    const FilterSampler filter(film);
    constexpr int kCells = 40, kSamples = 200000;
    std::vector<double> x(kCells, 0.0), y(kCells, 0.0), expected(kCells, 0.0);
    Rng rng(9);
    const double radius = film.filter_radius;
    const auto cell = [&](double offset) {
      return static_cast<std::size_t>(std::clamp((offset / radius + 1) / 2 * kCells, 0.0, kCells - 1.0));
    };
    for (int i = 0; i < kSamples; ++i) {
      const FilterSample sample = filter.sample(rng.next_2d());
      ASSERT_LE(std::abs(sample.offset.x), radius);
      x[cell(sample.offset.x)] += 1;
      y[cell(sample.offset.y)] += 1;
      const double value = filter_at(kind, sample.offset.x) * filter_at(kind, sample.offset.y);
      ASSERT_TRUE(std::abs(value) < 1e-4 || (value < 0) == (sample.weight < 0)) << sample.offset.x;
    }
    double norm = 0;
    for (int i = 0; i < kCells * 64; ++i) {
      const double weight = std::abs(filter_at(kind, radius * (2 * (i + 0.5) / (kCells * 64) - 1)));
      expected[static_cast<std::size_t>(i / 64)] += weight;
      norm += weight;
    }
    for (double& e : expected) e *= kSamples / norm;
    EXPECT_GT(testing_support::chi_square_p(x, expected), 1e-4);
    EXPECT_GT(testing_support::chi_square_p(y, expected), 1e-4);
  }
}

// What is weighed by a filter has the filter's moments: 1, 0, and its variance in closed form.
TEST(FilterSampler, WeightsKeepConstantsAndMoments) {
  // Of x^n times the gaussian that is cut at 2 and lowered to zero there, by hand.
  const double s = 0.6, cut = std::exp(-4 / (2 * s * s));
  const double mass = s * std::sqrt(2 * kPiD) * std::erf(2 / (s * std::sqrt(2.0)));
  const double gaussian = (s * s * mass - 4 * s * s * cut - cut * 16 / 3) / (mass - 4 * cut);
  const double variances[] = {1 / 12., 1 / 6., gaussian, 1 / 9.};
  for (std::size_t f = 0; f < std::size(kFilters); ++f) {
    const FilterSampler filter(film_with(kFilters[f]));
    constexpr std::uint32_t kSamples = 1 << 18;
    double sum = 0, lowest = 1;
    Vec3d mean(0), square(0);
    for (std::uint32_t i = 0; i < kSamples; ++i) {
      const FilterSample sample = filter.sample(sobol_2d(i, 17));
      const double weight = double{sample.weight} / kSamples;
      const Vec3d offset(sample.offset.x, sample.offset.y, 0);
      sum += weight;
      lowest = std::min(lowest, double{sample.weight});
      mean += offset * weight;
      square += offset * offset * weight;
    }
    EXPECT_NEAR(sum, 1, 1e-3) << f;
    EXPECT_NEAR(mean.x, 0, 2e-3) << f;
    EXPECT_NEAR(mean.y, 0, 2e-3) << f;
    EXPECT_NEAR(square.x, variances[f], 3e-3) << f;
    EXPECT_NEAR(square.y, variances[f], 3e-3) << f;
    EXPECT_EQ(lowest < 0, kFilters[f] == FilterKind::kMitchell);
  }
}

}  // namespace
}  // namespace nacre
