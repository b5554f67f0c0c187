// label: analytic
#include "nacre/geometry/primitives.h"

#include <gtest/gtest.h>

#include "nacre/base/error.h"
#include "nacre/geometry/topology.h"

namespace nacre {
namespace {

// Every triangle turns the way its normals point.
void expect_consistent_orientation(const Mesh& mesh) {
  ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
  ASSERT_EQ(mesh.uvs.size(), mesh.positions.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (const std::uint32_t v : mesh.triangles[i]) {
      ASSERT_GT(dot(face_normal(mesh, i), mesh.normals[v]), 0.99f);
      ASSERT_NEAR(mesh.normals[v].length(), 1, 1e-6);
    }
}

TEST(Primitives, Sphere) {
  const Mesh sphere = make_sphere();
  expect_consistent_orientation(sphere);
  EXPECT_EQ(sphere.triangles.size(), 81920u);
  EXPECT_NEAR(surface_area(sphere) / (4 * kPiD), 1, 2e-4);
  EXPECT_NEAR(signed_volume(sphere) / (4 * kPiD / 3), 1, 2e-4);
  const TopologyReport report = analyse_topology(sphere);
  EXPECT_TRUE(report.closed());
  EXPECT_EQ(report.vertices, 81920u / 2 + 2);
  std::vector<bool> used(sphere.positions.size(), false);
  for (const Triangle& t : sphere.triangles)
    for (const std::uint32_t v : t) used[v] = true;
  EXPECT_EQ(std::count(used.begin(), used.end(), false), 0);
  EXPECT_EQ(describe_problems(report), "");

  double deviation = 0;
  for (std::size_t i = 0; i < sphere.triangles.size(); ++i) {
    const Triangle& t = sphere.triangles[i];
    const Vec3 middle = (sphere.positions[t[0]] + sphere.positions[t[1]] + sphere.positions[t[2]]) / 3.0f;
    deviation = std::max(deviation, 1.0 - middle.length());
  }
  EXPECT_LT(deviation, 8e-5);
}

TEST(Primitives, SphereTextureCoordinatesAreSpherical) {
  const Mesh sphere = make_sphere();
  for (const Triangle& t : sphere.triangles) {
    float lowest = 9, highest = -9;
    for (const std::uint32_t v : t) {
      const Vec3& p = sphere.positions[v];
      const Vec2& uv = sphere.uvs[v];
      EXPECT_NEAR(1 - uv.y, std::acos(std::clamp(p.z, -1.0f, 1.0f)) / kPi, 1e-4);
      const float radius = std::hypot(p.x, p.y);
      if (radius > 1e-6f) {
        EXPECT_NEAR(std::cos(2 * kPi * uv.x), p.x / radius, 1e-4);
        EXPECT_NEAR(std::sin(2 * kPi * uv.x), p.y / radius, 1e-4);
      }
      lowest = std::min(lowest, uv.x);
      highest = std::max(highest, uv.x);
    }
    // No triangle spans the seam backwards: away from the poles u varies little.
    EXPECT_LE(highest - lowest, 0.26f);
    EXPECT_GE(lowest, 0.0f);
  }
}

TEST(Primitives, Rectangle) {
  const Mesh mesh = make_rectangle();
  expect_consistent_orientation(mesh);
  EXPECT_EQ(surface_area(mesh), 4);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    EXPECT_EQ(mesh.normals[v], Vec3(0, 0, 1));
    EXPECT_EQ(mesh.positions[v], Vec3(2 * mesh.uvs[v].x - 1, 2 * mesh.uvs[v].y - 1, 0));
  }
}

TEST(Primitives, Cube) {
  const Mesh mesh = make_cube();
  expect_consistent_orientation(mesh);
  EXPECT_EQ(mesh.triangles.size(), 12u);
  EXPECT_EQ(signed_volume(mesh), 8);
  EXPECT_EQ(bounds(mesh).min, Vec3(-1));
  EXPECT_EQ(bounds(mesh).max, Vec3(1));
  EXPECT_TRUE(analyse_topology(mesh).closed());
  // The corner of the +x face at which Mitsuba, whose v = 0 is the top of a picture, has (0, 1).
  bool found = false;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v)
    if (mesh.normals[v] == Vec3(1, 0, 0) && mesh.positions[v] == Vec3(1, -1, -1)) {
      EXPECT_EQ(mesh.uvs[v], Vec2(0, 0));
      found = true;
    }
  EXPECT_TRUE(found);
}

TEST(Primitives, Disk) {
  const Mesh mesh = make_disk();
  expect_consistent_orientation(mesh);
  EXPECT_NEAR(surface_area(mesh) / kPiD, 1, 2e-4);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    EXPECT_NEAR(mesh.positions[v].x, mesh.uvs[v].x * std::cos(2 * kPi * mesh.uvs[v].y), 1e-5);
    EXPECT_NEAR(mesh.positions[v].y, mesh.uvs[v].x * std::sin(2 * kPi * mesh.uvs[v].y), 1e-5);
  }
  const TopologyReport report = analyse_topology(mesh);
  EXPECT_EQ(report.boundary_loops, 1u);
  EXPECT_EQ(report.flipped_edges, 0u);
}

TEST(Primitives, Cylinder) {
  const Vec3 p0(1, 2, 3), p1(-2, 4, 3.5f);
  const Mesh mesh = make_cylinder(p0, p1, 0.25f, "test");
  expect_consistent_orientation(mesh);
  const double height = Vec3d(p1 - p0).length();
  EXPECT_NEAR(surface_area(mesh) / (2 * kPiD * 0.25 * height), 1, 1e-4);
  const TopologyReport report = analyse_topology(mesh);
  EXPECT_EQ(report.boundary_loops, 2u);
  EXPECT_EQ(report.flipped_edges, 0u);
  const Vec3 axis = (p1 - p0).normalized();
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const Vec3 foot = p0 + (p1 - p0) * mesh.uvs[v].y;
    EXPECT_LT((mesh.positions[v] - foot - mesh.normals[v] * 0.25f).length(), 1e-6f);
    EXPECT_NEAR(dot(mesh.normals[v], axis), 0, 1e-6);
  }
  // Along z, phi counts from x to y.
  const Mesh upright = make_cylinder(Vec3(0), Vec3(0, 0, 1), 1, "test");
  for (std::size_t v = 0; v < upright.positions.size(); ++v)
    EXPECT_NEAR(upright.positions[v].y, std::sin(2 * kPi * upright.uvs[v].x), 1e-5);
}

TEST(Primitives, CylinderRefusesBadInput) {
  const float nan = std::nanf("");
  EXPECT_THROW(make_cylinder(Vec3(0), Vec3(0, 0, 1), 0, "a:1"), Error);
  EXPECT_THROW(make_cylinder(Vec3(0), Vec3(0, 0, 1), -1, "a:1"), Error);
  EXPECT_THROW(make_cylinder(Vec3(0), Vec3(0, 0, 1), nan, "a:1"), Error);
  EXPECT_THROW(make_cylinder(Vec3(2), Vec3(2), 1, "a:1"), Error);
  EXPECT_THROW(make_cylinder(Vec3(nan), Vec3(2), 1, "a:1"), Error);
}

// Seen from outside, u to v turns counter-clockwise on every face: pictures are not mirrored.
TEST(Primitives, TextureCoordinatesAreNotMirrored) {
  for (const Mesh& mesh : {make_cube(), make_rectangle(), make_sphere()})
    for (const Triangle& t : mesh.triangles) {
      const Vec2 a = mesh.uvs[t[1]] - mesh.uvs[t[0]], b = mesh.uvs[t[2]] - mesh.uvs[t[0]];
      EXPECT_GT(a.x * b.y - a.y * b.x, 0);
    }
  EXPECT_NEAR(signed_volume(make_cube()), 8, 1e-6);
}

}  // namespace
}  // namespace nacre
