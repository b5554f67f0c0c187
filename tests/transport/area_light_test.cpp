// label: analytic
// Area lights seen from near and far: samples that are uniform by solid angle, with the density they claim.
#include "nacre/transport/area_light.h"

#include <gtest/gtest.h>

#include "base/statistics.h"
#include "nacre/base/random.h"
#include "transport/scene_parts.h"

namespace nacre {
namespace {

using namespace testing_support;

// Directions of samples in bins of equal solid angle: as often as the density and what is seen there say.
void expect_density(const Mesh& mesh, const Vec3& x, const char* what) {
  const Distribution areas(triangle_areas(mesh));
  const Mesh* meshes[] = {&mesh};
  const RayTracer tracer(meshes);
  constexpr int kCos = 12, kPhi = 24, kSamples = 200000, kFine = 64;
  std::vector<double> observed(kCos * kPhi), expected(kCos * kPhi);
  for (std::uint32_t n = 0; n < kSamples; ++n) {
    Rng rng(hash_words(5, n));
    const AreaSample sample = sample_area_light(mesh, areas, x, rng.next_2d());
    if (!(sample.pdf > 0)) continue;
    const Vec3 d = (sample.point - x).normalized();
    const Hit hit = tracer.intersect({x, d});
    if (hit) {
      ASSERT_NEAR(pdf_area_light(mesh, areas, x, hit) / sample.pdf, 1, 1e-3) << what;
    }
    const double phi = std::atan2(static_cast<double>(d.y), static_cast<double>(d.x)) / (2 * kPiD) + 0.5;
    const int row = std::min(static_cast<int>((static_cast<double>(d.z) + 1) / 2 * kCos), kCos - 1);
    const int column = std::min(static_cast<int>(phi * kPhi), kPhi - 1);
    ++observed[static_cast<std::size_t>(row * kPhi + column)];
  }
  for (int row = 0; row < kCos * kFine; ++row)
    for (int column = 0; column < kPhi * kFine; ++column) {
      const double z = 2 * (row + 0.5) / (kCos * kFine) - 1,
                   phi = (column + 0.5) / (kPhi * kFine) * 2 * kPiD - kPiD;
      const double r = std::sqrt(1 - z * z);
      const Vec3 d(static_cast<float>(r * std::cos(phi)), static_cast<float>(r * std::sin(phi)),
                   static_cast<float>(z));
      const Hit hit = tracer.intersect({x, d});
      if (!hit) continue;
      expected[static_cast<std::size_t>(row / kFine * kPhi + column / kFine)] +=
          static_cast<double>(pdf_area_light(mesh, areas, x, hit)) * kSamples * 4 * kPiD /
          (kCos * kPhi * kFine * kFine);
    }
  // Where the edge of the light cuts cells of the fine grid, they count in full or not at all.
  double total = 0;
  for (std::size_t i = 0; i < observed.size(); ++i) {
    total += expected[i];
    EXPECT_NEAR(observed[i], expected[i], 5 * std::sqrt(expected[i]) + 0.05 * expected[i] + 30) << what << i;
  }
  EXPECT_NEAR(total / kSamples, 1, 0.01) << what;
}

TEST(AreaLight, SamplesFollowTheirDensity) {
  expect_density(flipped(placed(make_rectangle(), Vec3(4, 1, 1), {0, 0, 1})), {0.5f, 0.2f, 0},
                 "near rectangle");
  expect_density(flipped(placed(make_rectangle(), Vec3(4, 4, 1), {3, 0, 0.2f})), {0.5f, 0.2f, 0},
                 "grazing rectangle");
  expect_density(placed(make_cube(), 1, {0, 0.5f, 3}), {0.5f, 0.2f, 0}, "cube");
  expect_density(flipped(placed(make_cube(), 1, {0, 0, 0})), {0.5f, 0.2f, 0}, "cube from inside");
}

// An even density: the solid angle is known without noise, and everything else is spread evenly.
TEST(AreaLight, FewTrianglesAreSpreadBySolidAngle) {
  const Mesh mesh = flipped(placed(make_rectangle(), Vec3(3, 2, 1), {1, 0, 1}));
  const Distribution areas(triangle_areas(mesh));
  // Source of the solid angle of a rectangle over its corner: 4 atan terms.
  const auto corner = [](double a, double b, double h) {
    return std::atan(a * b / (h * std::sqrt(a * a + b * b + h * h)));
  };
  const double omega = corner(4, 2, 1) * 2 + corner(2, 2, 1) * 2;
  double cosine = 0;
  constexpr int kSamples = 1024;
  for (std::uint32_t n = 0; n < kSamples; ++n) {
    const AreaSample sample = sample_area_light(mesh, areas, {0, 0, 0}, sobol_2d(n, 9));
    ASSERT_NEAR(static_cast<double>(sample.pdf), 1 / omega, 1e-5);
    ASSERT_NEAR(sample.point.z, 1, 1e-5);
    ASSERT_GE(sample.point.x, -2 - 1e-4f);
    ASSERT_LE(sample.point.x, 4 + 1e-4f);
    ASSERT_LE(std::abs(sample.point.y), 2 + 1e-4f);
    cosine += static_cast<double>(sample.point.normalized().z) * omega / kSamples;
  }
  // Irradiance of a rectangle in a parallel plane, from its corners.
  const auto view = [](double a, double b) {
    return 0.5 * (a / std::sqrt(1 + a * a) * std::atan(b / std::sqrt(1 + a * a)) +
                  b / std::sqrt(1 + b * b) * std::atan(a / std::sqrt(1 + b * b)));
  };
  EXPECT_NEAR(cosine / (2 * view(4, 2) + 2 * view(2, 2)), 1, 2e-3);
}

}  // namespace
}  // namespace nacre
