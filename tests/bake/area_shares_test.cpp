// label: analytic
// Voronoi cells against cells counted point by point, and shares of the surface.
#include "bake/area_shares.h"

#include <gtest/gtest.h>

#include <numeric>

#include "bake/surfaces.h"

namespace nacre {
namespace {

using namespace testing_support;

double sum(const std::vector<float>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

TEST(AreaShares, AddUpToTheArea) {
  const std::vector<std::vector<Mesh>> groups{
      {make_rectangle()},        {make_cube()},         {make_sphere()},
      {make_sliver_plane(2000)}, {make_bumpy_sphere()}, {make_disk(), placed(make_cube(), 2, {9, 0, 0})}};
  for (const auto& group : groups) {
    const GroupSurface surface = make_surface(group);
    const auto points = place(surface, 3000);
    const auto shares = share(surface, points);
    ASSERT_EQ(shares.size(), points.size());
    EXPECT_NEAR(sum(shares) / surface.areas.total(), 1, 1e-3);
    for (const float s : shares) EXPECT_GT(s, 0);
  }
}

TEST(AreaShares, AddUpOnEachPiece) {
  const std::vector<Mesh> meshes{placed(make_sphere(), 0.3f, {0, 0, 2}), make_rectangle(),
                                 placed(make_cube(), 0.8f, {4, 0, 0}),
                                 placed(make_disk(), 0.5f, {0, 0, 0.01f})};
  const GroupSurface surface = make_surface(meshes);
  ASSERT_EQ(surface.component_count, 4u);
  const auto points = place(surface, 8000);
  const auto shares = share(surface, points);
  std::vector<double> got(4, 0.0), wanted(4, 0.0);
  for (std::size_t i = 0; i < points.size(); ++i) got[surface.components[points[i].triangle]] += shares[i];
  for (std::size_t m = 0, t = 0; m < meshes.size(); t += meshes[m++].triangles.size())
    wanted[surface.components[t]] = surface_area(meshes[m]);
  for (std::size_t c = 0; c < 4; ++c) EXPECT_NEAR(got[c] / wanted[c], 1, 1e-3);
}

TEST(AreaShares, PiecesWithoutASampleLeaveTheirsToTheOthers) {
  const GroupSurface surface = make_surface({make_rectangle(), placed(make_rectangle(), 1e-4f, {0, 0, 3})});
  const auto points = place(surface, 100);
  EXPECT_NEAR(sum(share(surface, points)), surface.areas.total(), 1e-3 * surface.areas.total());
}

// How far areas of cells are from the areas of all that is nearer to a point than to any other, in the mean
// and at most, relative to the mean share. `probes` are points uniform by area; `may_own` says whether a
// sample is on the probe's sheet.
struct Deviation {
  double rms = 0, largest = 0;
};
template <class MayOwn>
Deviation compare(const std::vector<PlacedPoint>& points, const std::vector<float>& shares,
                  const std::vector<PlacedPoint>& probes, double area, const MayOwn& may_own) {
  std::vector<double> counted(points.size(), 0.0);
  for (const PlacedPoint& probe : probes) {
    std::size_t nearest = 0;
    float nearest2 = std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const float d2 = (points[i].position - probe.position).length2();
      if (d2 < nearest2 && may_own(points[i], probe)) nearest2 = d2, nearest = i;
    }
    counted[nearest] += area / static_cast<double>(probes.size());
  }
  Deviation deviation;
  const double mean = area / static_cast<double>(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double error = (static_cast<double>(shares[i]) - counted[i]) / mean;
    deviation.rms += error * error / static_cast<double>(points.size());
    deviation.largest = std::max(deviation.largest, std::abs(error));
  }
  deviation.rms = std::sqrt(deviation.rms);
  return deviation;
}

bool same_normal(const PlacedPoint& a, const PlacedPoint& b) { return dot(a.normal, b.normal) > 0.2f; }

// A raster over [-1,1]^2, shifted so that it does not line up with anything.
std::vector<PlacedPoint> raster(const Vec3& normal) {
  constexpr int kSide = 700;
  std::vector<PlacedPoint> probes;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const Vec3 local((static_cast<float>(x) + 0.5f) * 2 / kSide - 1,
                       (static_cast<float>(y) + 0.5f) * 2 / kSide - 1, 0);
      probes.push_back({local, 0, normal});
    }
  return probes;
}

// The raster itself is good to about 0.4 % of a cell. The mesh is [-1,1]^2, turned and moved.
void check_plane(const Mesh& mesh, const Frame& turned = make_frame({0, 0, 1}), const Vec3& moved = Vec3(0)) {
  const GroupSurface surface = make_surface({mesh});
  auto points = place(surface, 300);
  const auto shares = cell_areas(surface, points);
  for (PlacedPoint& point : points) {
    point.position = turned.to_local(point.position - moved);
    point.normal = turned.to_local(point.normal);
    EXPECT_GT(point.normal.z, 0.9f);
  }
  const Deviation deviation = compare(points, shares, raster({0, 0, 1}), surface.areas.total(), same_normal);
  EXPECT_LT(deviation.rms, 0.005);
  EXPECT_LT(deviation.largest, 0.03);
}

// Cells of samples near the border end there, so no cell is left out.
TEST(AreaShares, AreVoronoiCellsOnAPlane) { check_plane(make_rectangle()); }
TEST(AreaShares, DoNotDependOnTriangles) { check_plane(make_sliver_plane(4000)); }
// Rounding gives the thinnest slivers any normal, and makes no crease.
TEST(AreaShares, DoNotDependOnNormalsOfSlivers) {
  const Frame turned = make_frame(Vec3(1, 2, 3).normalized());
  const Vec3 moved(5, -3, 2);
  Mesh mesh = make_sliver_plane(3000);
  for (Vec3& p : mesh.positions) p = turned.to_world(p) + moved;
  check_plane(mesh, turned, moved);
}
TEST(AreaShares, EndAtABorderOfManyShortEdges) { check_plane(make_grid_plane(300)); }

TEST(AreaShares, EndAtCreases) {
  const GroupSurface surface = make_surface({make_cube()});
  const auto points = place(surface, 600);
  const auto shares = cell_areas(surface, points);
  // Probes face by face; only samples of that face can own one.
  std::vector<PlacedPoint> probes;
  Rng rng(5);
  for (int i = 0; i < 400000; ++i) {
    const std::size_t triangle = static_cast<std::size_t>(i) % surface.triangles.size();
    const Vec2 b = sample_uniform_triangle(rng.next_2d());
    const Triangle& t = surface.triangles[triangle];
    const Vec3& a = surface.positions[t[0]];
    probes.push_back({a + (surface.positions[t[1]] - a) * b.x + (surface.positions[t[2]] - a) * b.y, 0,
                      surface.normal(triangle)});
  }
  // 670 probes a cell: 4 % by chance.
  const Deviation deviation = compare(points, shares, probes, 24, same_normal);
  EXPECT_LT(deviation.rms, 0.05);
  EXPECT_LT(deviation.largest, 0.2);
  std::map<std::array<int, 3>, double> faces;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3& n = points[i].normal;
    faces[{static_cast<int>(std::lround(n.x)), static_cast<int>(std::lround(n.y)),
           static_cast<int>(std::lround(n.z))}] += shares[i];
  }
  ASSERT_EQ(faces.size(), 6u);
  for (const auto& [normal, area] : faces) EXPECT_NEAR(area, 4, 0.04);
}

TEST(AreaShares, AreVoronoiCellsOnASphere) {
  const GroupSurface surface = make_surface({make_sphere()});
  const auto points = place(surface, 800);
  const auto shares = cell_areas(surface, points);
  std::vector<PlacedPoint> probes;
  for (std::uint32_t i = 0; i < 400000; ++i) {
    const Vec3 direction = sample_uniform_sphere(sobol_2d(i, 9));
    probes.push_back({direction, 0, direction});
  }
  const Deviation deviation = compare(points, shares, probes, surface.areas.total(), same_normal);
  EXPECT_LT(deviation.rms, 0.025);
  EXPECT_LT(deviation.largest, 0.12);
}

TEST(AreaShares, OpposedSheetsDoNotShare) {
  const double target = 600;
  const auto gap = static_cast<float>(0.05 * hexagonal_spacing(8, target));
  const GroupSurface surface =
      make_surface({make_rectangle(), flipped(placed(make_rectangle(), 1, {0, 0, -gap}))});
  const auto points = place(surface, target);
  const auto shares = cell_areas(surface, points);
  for (const float side : {1.0f, -1.0f}) {
    std::vector<PlacedPoint> of_side;
    std::vector<float> their_shares;
    for (std::size_t i = 0; i < points.size(); ++i)
      if (points[i].normal.z * side > 0) {
        of_side.push_back(points[i]);
        of_side.back().position.z = 0;
        their_shares.push_back(shares[i]);
      }
    const Deviation deviation = compare(of_side, their_shares, raster({0, 0, side}), 4, same_normal);
    EXPECT_LT(deviation.rms, 0.005);
    EXPECT_LT(deviation.largest, 0.03);
  }
}

TEST(AreaShares, AHandfulOfPoints) {
  for (const double target : {1.0, 2.0, 5.0})
    for (const Mesh& mesh : {make_rectangle(), make_cube(), placed(make_sphere(), 1e-6f, Vec3(0))}) {
      const GroupSurface surface = make_surface({mesh});
      const auto shares = share(surface, place(surface, target));
      EXPECT_NEAR(sum(shares) / surface.areas.total(), 1, 1e-3);
    }
  EXPECT_TRUE(share(make_surface({make_rectangle()}), {}).empty());
}

// Edges a hundred thousand spacings long.
TEST(AreaShares, Hair) {
  const GroupSurface surface = make_surface({make_hair()});
  const auto points = place(surface, 2000);
  EXPECT_NEAR(sum(share(surface, points)) / surface.areas.total(), 1, 1e-3);
}

TEST(AreaShares, DegenerateTrianglesChangeNothing) {
  Mesh mesh = make_rectangle();
  mesh.normals.clear();
  mesh.positions.emplace_back(0.25f, 0.25f, 0.0f);  // on the diagonal
  mesh.triangles.insert(mesh.triangles.end(), {{0, 2, 4}, {0, 0, 1}, {2, 2, 2}});
  const GroupSurface plain = make_surface({make_rectangle()}), spoiled = make_surface({mesh});
  const auto points = place(plain, 300);
  const auto expected = share(plain, points), shares = share(spoiled, points);
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_NEAR(shares[i] / expected[i], 1, 1e-3);
}

}  // namespace
}  // namespace nacre
