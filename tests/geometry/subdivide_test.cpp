// label: analytic
#include "nacre/geometry/subdivide.h"

#include <gtest/gtest.h>

#include <array>
#include <set>

#include "nacre/geometry/primitives.h"
#include "nacre/geometry/topology.h"

namespace nacre {
namespace {

std::array<float, 3> key(const Vec3& p) { return {p.x, p.y, p.z}; }

// A flat piece of the regular triangle grid, rotated into space.
Mesh make_grid(std::uint32_t n) {
  Mesh mesh;
  for (std::uint32_t j = 0; j <= n; ++j)
    for (std::uint32_t i = 0; i <= n; ++i)
      mesh.positions.emplace_back(static_cast<float>(i), static_cast<float>(j), 0.0f);
  for (std::uint32_t j = 0; j < n; ++j)
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
      mesh.triangles.push_back({a, b, d});
      mesh.triangles.push_back({a, d, c});
    }
  return mesh;
}

TEST(Subdivide, CountsAndTopology) {
  Warnings warnings;
  for (int levels = 0; levels < 4; ++levels) {
    const Mesh mesh = subdivide_loop(make_cube(), levels, "test", warnings);
    const TopologyReport report = analyse_topology(mesh);
    EXPECT_EQ(report.triangles, 12u << (2 * levels));
    EXPECT_EQ(report.vertices, report.triangles / 2 + 2);
    EXPECT_EQ(describe_problems(report), "");
    EXPECT_TRUE(mesh.uvs.empty());
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
  }
  EXPECT_TRUE(warnings.empty());
}

TEST(Subdivide, VerticesLieOnOneLimitSurface) {
  // Points of a coarser level are points of every finer one: positions and normals are those of the limit.
  Warnings warnings;
  const Mesh coarse = subdivide_loop(make_cube(), 1, "test", warnings);
  const Mesh fine = subdivide_loop(make_cube(), 3, "test", warnings);
  for (std::size_t i = 0; i < coarse.positions.size(); ++i) {
    std::size_t nearest = 0;
    for (std::size_t j = 0; j < fine.positions.size(); ++j)
      if ((fine.positions[j] - coarse.positions[i]).length2() <
          (fine.positions[nearest] - coarse.positions[i]).length2())
        nearest = j;
    EXPECT_LT((fine.positions[nearest] - coarse.positions[i]).length(), 1e-6f);
    EXPECT_LT((fine.normals[nearest] - coarse.normals[i]).length(), 1e-5f);
  }
}

TEST(Subdivide, LimitOfOctahedronVertex) {
  // Valence 4, beta = (5/8 - (3/8)^2) / 4 = 31/256: the limit of a vertex at distance 1 whose neighbours
  // average to 0 is w / (w + 4) with w = 3 / (8 beta) = 96/31, which is 96/220.
  Mesh octahedron;
  octahedron.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  octahedron.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                          {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  Warnings warnings;
  const Mesh limit = subdivide_loop(octahedron, 0, "test", warnings);
  for (std::size_t v = 0; v < 6; ++v) {
    EXPECT_NEAR(limit.positions[v].length(), 96.0 / 220, 1e-6);
    EXPECT_LT((limit.normals[v] - limit.positions[v].normalized()).length(), 1e-6f);
  }
}

TEST(Subdivide, FlatStaysFlatAndBordersFollowTheirSpline) {
  Warnings warnings;
  const Mesh mesh = subdivide_loop(make_grid(4), 3, "test", warnings);
  EXPECT_TRUE(warnings.empty());
  std::set<std::array<float, 3>> points;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    points.insert(key(mesh.positions[v]));
    EXPECT_EQ(mesh.positions[v].z, 0);
    EXPECT_LT((mesh.normals[v] - Vec3(0, 0, 1)).length(), 1e-6f);
  }
  // A corner becomes (1 4 1)/6 of itself and its neighbours on the border, the middles of sides stay.
  EXPECT_TRUE(points.contains(key(Vec3(1.0f / 6, 1.0f / 6, 0))));
  EXPECT_TRUE(points.contains(key(Vec3(2, 0, 0))));
  EXPECT_TRUE(points.contains(key(Vec3(2, 2, 0))));
  EXPECT_EQ(analyse_topology(mesh).boundary_loops, 1u);
}

TEST(Subdivide, FacetsBecomeSmooth) {
  // The cube's faces and its corners' normals differ by 55 degrees, those of the blob after four levels
  // hardly.
  Warnings warnings;
  Mesh cube = make_cube();
  const Mesh mesh = subdivide_loop(cube, 4, "test", warnings);
  double largest = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (const std::uint32_t v : mesh.triangles[i])
      largest =
          std::max(largest, std::acos(std::min(1.0, double{dot(face_normal(mesh, i), mesh.normals[v])})));
  EXPECT_LT(largest * 180 / kPiD, 8);
}

TEST(Subdivide, HighValence) {
  // OpenMesh's table of weights ends at valence 50.
  Mesh cone;
  constexpr std::uint32_t kCount = 500;
  cone.positions = {{0, 0, 1}, {0, 0, -1}};
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const float phi = 2 * kPi * static_cast<float>(i) / kCount;
    cone.positions.emplace_back(std::cos(phi), std::sin(phi), 0.0f);
    const std::uint32_t a = 2 + i, b = 2 + (i + 1) % kCount;
    cone.triangles.push_back({0, a, b});
    cone.triangles.push_back({1, b, a});
  }
  Warnings warnings;
  const Mesh mesh = subdivide_loop(cone, 2, "test", warnings);
  EXPECT_EQ(describe_problems(analyse_topology(mesh)), "");
  for (const Vec3& p : mesh.positions) {
    ASSERT_TRUE(is_finite(p));
    ASSERT_LE(p.length(), 1.0f);
  }
}

TEST(Subdivide, OpensUpWhatIsNoManifold) {
  Mesh mesh = make_cube();
  mesh.positions.emplace_back(3.0f, 3.0f, 0.0f);
  std::uint32_t a = 0, b = 0;
  for (std::uint32_t v = 0; v < 24; ++v) {
    if (mesh.positions[v] == Vec3(1, 1, -1)) a = v;
    if (mesh.positions[v] == Vec3(1, 1, 1)) b = v;
  }
  mesh.triangles.push_back({a, b, 24});  // a fin
  Warnings warnings;
  const Mesh result = subdivide_loop(mesh, 2, "scene.xml:3", warnings);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].rfind("scene.xml:3: ", 0), 0u);
  EXPECT_NE(warnings[0].find("2 vertices"), std::string::npos);
  const TopologyReport report = analyse_topology(result);
  EXPECT_EQ(report.triangles, 13u * 16);
  EXPECT_EQ(report.components, 2u);  // the cube is whole again
  EXPECT_EQ(report.boundary_loops, 1u);
}

TEST(Subdivide, DuplicateFacesDoNotCount) {
  Mesh mesh = make_cube();
  mesh.triangles.push_back(mesh.triangles[0]);
  mesh.triangles.push_back({0, 0, 1});
  Warnings warnings;
  EXPECT_EQ(subdivide_loop(mesh, 1, "test", warnings).triangles.size(), 48u);
  EXPECT_TRUE(warnings.empty());
}

TEST(Subdivide, RefusesWhatItCannotDo) {
  Warnings warnings;
  const auto code_of = [&](const Mesh& mesh, int levels) {
    try {
      subdivide_loop(mesh, levels, "scene.xml:3", warnings);
    } catch (const Error& e) {
      EXPECT_EQ(e.place(), "scene.xml:3");
      return e.code();
    }
    return ErrorCode::kIo;
  };
  Mesh degenerate = make_cube();
  for (Triangle& t : degenerate.triangles) t[1] = t[0];
  EXPECT_EQ(code_of(degenerate, 1), ErrorCode::kValue);
  EXPECT_EQ(code_of(Mesh(), 1), ErrorCode::kValue);
  EXPECT_EQ(code_of(make_cube(), -1), ErrorCode::kValue);
  EXPECT_EQ(code_of(make_cube(), 12), ErrorCode::kLimit);
  EXPECT_EQ(code_of(make_cube(), 2'000'000'000), ErrorCode::kLimit);
}

}  // namespace
}  // namespace nacre
