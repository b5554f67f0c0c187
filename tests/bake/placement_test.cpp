// label: analytic
// Samples keep their distance, come in the number asked for, and cover every part of a surface alike.
#include "bake/placement.h"

#include <gtest/gtest.h>

#include <cstring>

#include "bake/surfaces.h"
#include "base/statistics.h"
#include "nacre/base/error.h"
#include "nacre/base/parallel.h"

namespace nacre {
namespace {

using namespace testing_support;

void check_spacing_and_count(const std::vector<Mesh>& meshes, double target) {
  const GroupSurface surface = make_surface(meshes);
  for (const std::uint64_t seed : {1u, 2u}) {
    const auto points = place(surface, target, seed);
    EXPECT_NEAR(static_cast<double>(points.size()) / target, 1, 0.03);
    EXPECT_GE(relative_radius(surface, points), 0.70);
  }
}

TEST(Placement, Plane) { check_spacing_and_count({make_rectangle()}, 10000); }
TEST(Placement, Sphere) { check_spacing_and_count({make_sphere()}, 10000); }
TEST(Placement, Cube) { check_spacing_and_count({make_cube()}, 20000); }
TEST(Placement, Slivers) { check_spacing_and_count({make_sliver_plane(4000)}, 10000); }
TEST(Placement, BumpySphere) { check_spacing_and_count({make_bumpy_sphere()}, 20000); }
TEST(Placement, SeveralShapesInOneGroup) {
  check_spacing_and_count({placed(make_sphere(), 0.5f, {3, 0, 0}), placed(make_cube(), 0.7f, {0, 0, 1}),
                           make_rectangle(), placed(make_sliver_plane(500), 2, {0, 10, -3})},
                          20000);
}
TEST(Placement, FarFromTheOrigin) {
  check_spacing_and_count({placed(make_rectangle(), 1, {300, -500, 200})}, 5000);
}

bool same(const std::vector<PlacedPoint>& a, const std::vector<PlacedPoint>& b) {
  static_assert(sizeof(PlacedPoint) == 28);  // no padding
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(PlacedPoint)) == 0;
}

TEST(Placement, DependsOnSurfaceTargetAndSeedAlone) {
  const GroupSurface surface = make_surface({make_bumpy_sphere(), make_rectangle()});
  std::vector<PlacedPoint> one, two;
  {
    const ThreadLimit limit(1);
    one = place(surface, 20000);
  }
  {
    const ThreadLimit limit(2);
    two = place(surface, 20000);
  }
  EXPECT_TRUE(same(one, two));
  EXPECT_FALSE(same(one, place(surface, 20000, 2)));
}

TEST(Placement, PointsLieOnTheirTriangles) {
  const GroupSurface surface = make_surface({make_bumpy_sphere()});
  for (const PlacedPoint& point : place(surface, 5000)) {
    ASSERT_LT(point.triangle, surface.triangles.size());
    const Triangle& t = surface.triangles[point.triangle];
    const Vec3d a(surface.positions[t[0]]), b(surface.positions[t[1]]), c(surface.positions[t[2]]);
    const Vec3d p(point.position);
    const double whole = (b - a).cross(c - a).length();
    const double parts =
        (b - a).cross(p - a).length() + (c - b).cross(p - b).length() + (a - c).cross(p - c).length();
    EXPECT_NEAR(parts / whole, 1, 1e-3);  // inside, and in its plane
    EXPECT_NEAR(point.normal.length(), 1, 1e-5);
    EXPECT_EQ(point.normal, surface.normal(point.triangle));
  }
}

// Points that keep a distance scatter less than a Poisson process, so chi-square is on the safe side: cells
// differ by less than chance would have it.
double uniformity_p(const GroupSurface& surface, double target) {
  constexpr int kCells = 12;
  std::vector<double> counts(kCells * kCells, 0.0);
  double inside = 0;
  for (const std::uint64_t seed : {1u, 2u, 3u})
    for (const PlacedPoint& point : place(surface, target, seed)) {
      // Without the borders, where fewer neighbours keep a point away.
      const float x = (point.position.x + 0.9f) / 1.8f, y = (point.position.y + 0.9f) / 1.8f;
      if (x < 0 || x >= 1 || y < 0 || y >= 1) continue;
      counts[static_cast<std::size_t>(static_cast<int>(x * kCells) * kCells +
                                      static_cast<int>(y * kCells))] += 1;
      ++inside;
    }
  return chi_square_p(counts,
                      std::vector<double>(counts.size(), inside / static_cast<double>(counts.size())));
}

TEST(Placement, DensityDoesNotFollowTriangleSizes) {
  EXPECT_GT(uniformity_p(make_surface({make_rectangle()}), 10000), 0.01);
  EXPECT_GT(uniformity_p(make_surface({make_sliver_plane(4000)}), 10000), 0.01);
  // Two triangles on the left, 20,000 on the right.
  const Mesh left = placed(make_rectangle(), {0.5f, 1, 1}, {-0.5f, 0, 0});
  const Mesh right = placed(make_grid_plane(100), {0.5f, 1, 1}, {0.5f, 0, 0});
  const GroupSurface surface = make_surface({left, right});
  EXPECT_GT(uniformity_p(surface, 10000), 0.01);
  double on_left = 0, all = 0;
  for (const PlacedPoint& point : place(surface, 40000)) {
    on_left += point.position.x < 0 ? 1 : 0;
    ++all;
  }
  EXPECT_NEAR(on_left / all, 0.5, 0.005);
}

TEST(Placement, DensityIsUniformOnTheSphere) {
  // Bands of equal height have equal area.
  constexpr int kBands = 16, kSectors = 8;
  std::vector<double> counts(kBands * kSectors, 0.0);
  const auto points = place(make_surface({make_sphere()}), 30000);
  for (const PlacedPoint& point : points) {
    const int band = std::clamp(static_cast<int>((point.position.z + 1) / 2 * kBands), 0, kBands - 1);
    const float turn = std::atan2(point.position.y, point.position.x) / (2 * kPi) + 0.5f;
    const int sector = std::clamp(static_cast<int>(turn * kSectors), 0, kSectors - 1);
    counts[static_cast<std::size_t>(band * kSectors + sector)] += 1;
  }
  const double expected = static_cast<double>(points.size()) / static_cast<double>(counts.size());
  EXPECT_GT(chi_square_p(counts, std::vector<double>(counts.size(), expected)), 0.01);
}

TEST(Placement, BothSidesOfAThinSheetKeepTheirDensity) {
  const double target = 10000;
  const auto gap = static_cast<float>(0.05 * hexagonal_spacing(8, target));
  const GroupSurface surface =
      make_surface({make_rectangle(), flipped(placed(make_rectangle(), 1, {0, 0, -gap}))});
  double top = 0, bottom = 0;
  for (const PlacedPoint& point : place(surface, target)) (point.normal.z > 0 ? top : bottom) += 1;
  EXPECT_NEAR(top / (target / 2), 1, 0.03);
  EXPECT_NEAR(bottom / (target / 2), 1, 0.03);
}

TEST(Placement, AHandfulOfPoints) {
  for (const double target : {0.2, 1.0, 2.0, 3.0, 7.0})
    for (const Mesh& mesh : {make_rectangle(), make_cube(), make_sphere()}) {
      const auto points = place(make_surface({mesh}), target);
      EXPECT_GE(points.size(), 1u);
      EXPECT_LE(static_cast<double>(points.size()), 2 * target + 1);
    }
}

// Where there is room for any number of points, no more come than were asked for.
TEST(Placement, DustAndHair) {
  std::vector<Mesh> dust;
  for (int i = 0; i < 400; ++i)
    dust.push_back(
        placed(make_rectangle(), 1e-3f, Vec3(static_cast<float>(i % 20), static_cast<float>(i / 20), 0)));
  for (const GroupSurface& surface : {make_surface(dust), make_surface({make_hair()})})
    for (const double target : {100.0, 300.0, 2000.0})
      EXPECT_NEAR(static_cast<double>(place(surface, target).size()) / target, 1, 0.15) << target;
}

TEST(Placement, TinyAndHugeSurfaces) {
  for (const float size : {1e-7f, 1e7f}) {
    const auto points = place(make_surface({placed(make_sphere(), size, Vec3(0))}), 2000);
    EXPECT_NEAR(static_cast<double>(points.size()) / 2000, 1, 0.03);
  }
}

TEST(Placement, DegenerateTrianglesGetNoPoints) {
  Mesh mesh = make_rectangle();
  const auto v = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), {{5, 5, 5}, {6, 6, 6}, {7, 7, 7}});
  mesh.triangles.insert(mesh.triangles.begin(), {{v, v + 1, v + 2}, {v, v, v}, {v, v + 1, v}});
  mesh.normals.clear();
  const auto points = place(make_surface({mesh}), 1000);
  EXPECT_NEAR(static_cast<double>(points.size()), 1000, 30);
  for (const PlacedPoint& point : points) EXPECT_GE(point.triangle, 3u);

  mesh.triangles.resize(3);
  EXPECT_TRUE(place(make_surface({mesh}), 1000).empty());
  EXPECT_TRUE(place(make_surface({}), 1000).empty());
}

TEST(Placement, RefusesSamplesThatAreFarTooClose) {
  // Two specks a world apart.
  const GroupSurface surface = make_surface(
      {placed(make_rectangle(), 1e-4f, {0, 0, 0}), placed(make_rectangle(), 1e-4f, {1e6f, 0, 0})});
  try {
    place(surface, 1000);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kLimit);
    EXPECT_NE(error.reason().find("scale"), std::string::npos);
  }
}

}  // namespace
}  // namespace nacre
