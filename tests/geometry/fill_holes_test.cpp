// label: analytic
// Holes of every kind: closed, oriented, and as large as they have to be.
#include "nacre/geometry/fill_holes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "nacre/geometry/primitives.h"
#include "nacre/geometry/topology.h"

namespace nacre {
namespace {

// Without the triangles of which `is_gone` is true at the centre.
template <class IsGone>
Mesh with_holes(Mesh mesh, const IsGone& is_gone) {
  std::erase_if(mesh.triangles, [&](const Triangle& t) {
    return is_gone((mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) / 3.0f);
  });
  return mesh;
}

// A box of n x n x 1 unit cubes whose top, at z = 1, is missing where `is_gone` of the middle of a square.
template <class IsGone>
Mesh make_box(int n, const IsGone& is_gone) {
  Mesh mesh;
  const auto quad = [&](const Vec3& at, const Vec3& u, const Vec3& v) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const Vec3& p : {at, at + u, at + u + v, at + v}) mesh.positions.push_back(p);
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
  };
  const Vec3 x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  const auto size = static_cast<float>(n);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const auto a = static_cast<float>(i), b = static_cast<float>(j);
      quad({a, b, 0}, y, x);
      if (!is_gone(a + 0.5f, b + 0.5f)) quad({a, b, 1}, x, y);
    }
  for (int i = 0; i < n; ++i) {
    const auto a = static_cast<float>(i);
    quad({a, 0, 0}, x, z);
    quad({a + 1, size, 0}, -x, z);
    quad({0, a + 1, 0}, -y, z);
    quad({size, a, 0}, y, z);
  }
  return mesh;
}

TEST(FillHoles, FlatHolesOfAnyOutlineHaveTheirArea) {
  Warnings warnings;
  const auto inside = [](float x, float y, float x0, float y0, float x1, float y1) {
    return x > x0 && x < x1 && y > y0 && y < y1;
  };
  const auto l_shape = [&](float x, float y) { return inside(x, y, 1, 1, 2, 5) || inside(x, y, 1, 1, 5, 2); };
  const auto two_that_touch = [&](float x, float y) {
    return inside(x, y, 1, 1, 3, 3) || inside(x, y, 3, 3, 5, 5);
  };
  const auto comb = [&](float x, float y) {
    return inside(x, y, 1, 1, 6, 2) || (inside(x, y, 1, 1, 6, 5) && static_cast<int>(x) % 2 == 1);
  };
  const auto all = [](float, float) { return true; };
  const auto check = [&](const auto& is_gone, std::size_t loops) {
    Mesh mesh = make_box(7, is_gone);
    EXPECT_EQ(fill_holes(mesh, "test", warnings), loops);
    EXPECT_EQ(describe_problems(analyse_topology(mesh)), "");
    EXPECT_NEAR(signed_volume(mesh), 49, 1e-5);
    EXPECT_NEAR(surface_area(mesh), 2 * 49 + 4 * 7, 1e-4);
  };
  check(l_shape, 1);
  check(comb, 1);
  check(all, 1);
  check(two_that_touch, 2);
  EXPECT_TRUE(warnings.empty());
}

TEST(FillHoles, ScansAreClosedWithNormalsOfTheirOwn) {
  Warnings warnings;
  const auto near = [](const Vec3& p, const Vec3& at, float r) { return (p - at).length() < r; };
  Mesh mesh = with_holes(make_sphere(), [&](const Vec3& p) {
    return near(p, {0, 0, 1}, 0.3f) || near(p, {1, 0, 0}, 0.2f) || near(p, {0, -1, 0}, 0.1f);
  });
  ASSERT_FALSE(mesh.normals.empty());
  const double before = signed_volume(make_sphere());
  EXPECT_EQ(fill_holes(mesh, "test", warnings), 3u);
  EXPECT_EQ(describe_problems(analyse_topology(mesh)), "");
  EXPECT_NEAR(signed_volume(mesh), before, 0.02 * before);
  EXPECT_LT(signed_volume(mesh), before);
  ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Vec3 normal = face_normal(mesh, i);
    if (normal.length() < 0.5f) continue;  // degenerate, at the poles
    for (const std::uint32_t v : mesh.triangles[i]) EXPECT_GT(mesh.normals[v].dot(normal), 0.7f);
  }
  EXPECT_TRUE(warnings.empty());
}

// Every fifth triangle is the wrong way round, those beside holes, too.
TEST(FillHoles, FlippedFacesBesideThem) {
  Mesh mesh = with_holes(make_sphere(), [](const Vec3& p) {
    return (p - Vec3(0, 0.6f, 0.8f)).length() < 0.3f || (p - Vec3(0.8f, 0, -0.6f)).length() < 0.2f;
  });
  const std::size_t before = mesh.triangles.size();
  for (std::size_t i = 0; i < before; i += 5) std::swap(mesh.triangles[i][0], mesh.triangles[i][1]);
  const std::uint64_t duplicates = analyse_topology(mesh).duplicate_faces;
  Warnings warnings;
  EXPECT_EQ(fill_holes(mesh, "test", warnings), 2u);
  EXPECT_TRUE(warnings.empty());
  const TopologyReport report = analyse_topology(mesh);
  EXPECT_TRUE(report.closed());
  EXPECT_EQ(report.duplicate_faces, duplicates);
  // What is new looks outwards, as most faces beside it do.
  for (std::size_t i = before; i < mesh.triangles.size(); ++i)
    EXPECT_GT(face_normal(mesh, i).dot(mesh.positions[mesh.triangles[i][0]]), 0);
}

// A face that hangs in a hole by one edge is not covered by another one.
TEST(FillHoles, FacesThatStickOut) {
  // A square hole in the top of a box, across one side of which a triangle reaches.
  Mesh mesh = make_box(3, [](float x, float y) { return x > 1 && x < 2 && y > 1 && y < 2; });
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (const Vec3& p : {Vec3(1, 1, 1), Vec3(2, 1, 1), Vec3(1.5f, 1.02f, 1)}) mesh.positions.push_back(p);
  mesh.triangles.push_back({first, first + 1, first + 2});
  Warnings warnings;
  EXPECT_EQ(fill_holes(mesh, "test", warnings), 1u);
  EXPECT_EQ(describe_problems(analyse_topology(mesh)), "");
  EXPECT_NEAR(surface_area(mesh), 2 * 9 + 4 * 3, 1e-4);
}

// An open cylinder of 3000 sides: more than are worth the best triangulation.
TEST(FillHoles, LargeLoops) {
  constexpr std::uint32_t kSides = 3000;
  Mesh mesh;
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const float phi = 2 * kPi * static_cast<float>(i) / kSides;
    mesh.positions.emplace_back(std::cos(phi), std::sin(phi), 0.0f);
    mesh.positions.emplace_back(std::cos(phi), std::sin(phi), 1.0f);
  }
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const std::uint32_t a = 2 * i, b = 2 * ((i + 1) % kSides);
    mesh.triangles.push_back({a, b, b + 1});
    mesh.triangles.push_back({a, b + 1, a + 1});
  }
  Warnings warnings;
  EXPECT_EQ(fill_holes(mesh, "test", warnings), 2u);
  EXPECT_EQ(describe_problems(analyse_topology(mesh)), "");
  EXPECT_NEAR(signed_volume(mesh), kPi, 1e-4);
  EXPECT_TRUE(warnings.empty());
}

TEST(FillHoles, ClosedMeshesStayAsTheyAre) {
  Warnings warnings;
  Mesh mesh = make_cube();
  const Mesh before = mesh;
  EXPECT_EQ(fill_holes(mesh, "test", warnings), 0u);
  EXPECT_EQ(mesh.triangles, before.triangles);
  EXPECT_EQ(mesh.positions, before.positions);
  Mesh empty;
  EXPECT_EQ(fill_holes(empty, "test", warnings), 0u);
}

// A fin on an edge of a closed cube: its three free sides do not come back to where they began.
TEST(FillHoles, SaysWhatItCannotClose) {
  Mesh mesh = make_cube();
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.emplace_back(1.0f, 1.0f, -1.0f);
  mesh.positions.emplace_back(1.0f, 1.0f, 1.0f);
  mesh.positions.emplace_back(3.0f, 3.0f, 0.0f);
  mesh.triangles.push_back({first, first + 1, first + 2});
  Warnings warnings;
  EXPECT_EQ(fill_holes(mesh, "scene.xml:3", warnings), 0u);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("scene.xml:3: 2 boundary edges"), std::string::npos) << warnings[0];
}

}  // namespace
}  // namespace nacre
