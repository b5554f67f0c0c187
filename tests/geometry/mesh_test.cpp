// label: unit
#include "nacre/geometry/mesh.h"

#include <gtest/gtest.h>

#include <limits>

#include "nacre/base/error.h"
#include "nacre/base/random.h"
#include "nacre/geometry/primitives.h"

namespace nacre {
namespace {

Matrix4 scale_and_move(const Vec3d& scale, const Vec3d& move) {
  Matrix4 m;
  m.setScale(scale);
  for (int i = 0; i < 3; ++i) m[3][i] = move[i];
  return m;
}

double angle_degrees(const Vec3& a, const Vec3& b) {
  return std::acos(std::clamp(double{dot(a, b)}, -1.0, 1.0)) * 180 / kPiD;
}

TEST(Mesh, MeasuresOfCube) {
  Mesh cube = make_cube();
  EXPECT_DOUBLE_EQ(surface_area(cube), 24);
  EXPECT_DOUBLE_EQ(signed_volume(cube), 8);
  flip_normals(cube);
  EXPECT_DOUBLE_EQ(signed_volume(cube), -8);
  EXPECT_EQ(cube.normals[0], -make_cube().normals[0]);
  for (std::size_t i = 0; i < cube.triangles.size(); ++i)
    EXPECT_EQ(face_normal(cube, i), cube.normals[cube.triangles[i][0]]);
}

TEST(Mesh, BoundsLeaveOutUnusedVertices) {
  Mesh mesh = make_rectangle();
  mesh.positions.emplace_back(1e9f);
  EXPECT_EQ(bounds(mesh).min, Vec3(-1, -1, 0));
  EXPECT_EQ(bounds(mesh).max, Vec3(1, 1, 0));
  EXPECT_TRUE(bounds(Mesh()).isEmpty());
  EXPECT_EQ(signed_volume(Mesh()), 0);
}

TEST(Mesh, VolumeFarFromOriginDoesNotCancel) {
  Mesh cube = make_cube();
  transform_mesh(cube, scale_and_move(Vec3d(1), Vec3d(1 << 20, -(1 << 20), 1 << 19)), "test");
  EXPECT_DOUBLE_EQ(signed_volume(cube), 8);
}

TEST(Mesh, TransformKeepsNormalsPerpendicular) {
  for (const Vec3d& scale :
       {Vec3d(3, 0.5, 2), Vec3d(-3, 0.5, 2), Vec3d(1e-12, 1e-12, 1e-12), Vec3d(-1, -1, -1)}) {
    Mesh sphere = make_sphere();
    const double volume = signed_volume(sphere);
    transform_mesh(sphere, scale_and_move(scale, Vec3d(0)), "test");
    EXPECT_NEAR(signed_volume(sphere) / (volume * std::abs(scale.x * scale.y * scale.z)), 1, 1e-6);
    for (std::size_t i = 0; i < sphere.triangles.size(); i += 97)
      for (const std::uint32_t v : sphere.triangles[i]) {
        EXPECT_NEAR(sphere.normals[v].length(), 1, 1e-6);
        EXPECT_LT(angle_degrees(face_normal(sphere, i), sphere.normals[v]), 6);
      }
  }
}

TEST(Mesh, TransformRotatesAndShears) {
  // Row vectors: x goes to y, y to -x + z, z to z.
  const Matrix4 m(0, 1, 0, 0, -1, 0, 1, 0, 0, 0, 1, 0, 5, 6, 7, 1);
  Mesh mesh = make_rectangle();
  transform_mesh(mesh, m, "test");
  EXPECT_EQ(mesh.positions[2], Vec3(-1 + 5, 1 + 6, 1 + 7));
  EXPECT_LT((mesh.normals[0] - face_normal(mesh, 0)).length(), 1e-6f);
}

TEST(Mesh, TransformRefusesWhatIsNotOne) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Matrix4 projective;
  projective[0][3] = 1;
  Matrix4 dependent(1, 2, 3, 0, 2, 4, 6, 0, 0, 0, 1, 0, 0, 0, 0, 1);
  for (const Matrix4& m : {scale_and_move({1, 0, 1}, Vec3d(0)), scale_and_move({1, nan, 1}, Vec3d(0)),
                           scale_and_move(Vec3d(1), {0, 0, 1 / 0.0}), scale_and_move(Vec3d(1e300), Vec3d(0)),
                           projective, dependent}) {
    Mesh mesh = make_cube();
    try {
      transform_mesh(mesh, m, "scene.xml:7");
      ADD_FAILURE() << "accepted " << m;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kValue);
      EXPECT_EQ(e.place(), "scene.xml:7");
    }
  }
}

TEST(Mesh, WeldMapFindsFirstVertexOfEachPosition) {
  Mesh mesh;
  mesh.positions = {{0, 1, 2}, {0, 1, 3}, {-0.0f, 1, 2}, {0, 1, 3}, {0, 1, std::nextafter(3.0f, 4.0f)}};
  EXPECT_EQ(weld_map(mesh), (std::vector<std::uint32_t>{0, 1, 0, 1, 4}));
  EXPECT_TRUE(weld_map(Mesh()).empty());
}

TEST(Mesh, SmoothNormalsOfCubePointToCorners) {
  // Angle weights make the diagonals of the faces irrelevant.
  Mesh cube = make_cube();
  compute_normals(cube, 180);
  ASSERT_EQ(cube.positions.size(), 24u);
  for (std::size_t v = 0; v < cube.positions.size(); ++v)
    EXPECT_LT((cube.normals[v] - cube.positions[v] / std::sqrt(3.0f)).length(), 1e-6f);
}

TEST(Mesh, CreasesSplitVertices) {
  Mesh cube;  // eight shared vertices
  const Mesh split = make_cube();
  const std::vector<std::uint32_t> weld = weld_map(split);
  cube.positions = split.positions;
  for (const Triangle& t : split.triangles) cube.triangles.push_back({weld[t[0]], weld[t[1]], weld[t[2]]});
  for (const Vec3& p : cube.positions) cube.uvs.emplace_back(p.x, p.y);
  compute_normals(cube, 89);
  ASSERT_EQ(cube.normals.size(), cube.positions.size());
  ASSERT_EQ(cube.uvs.size(), cube.positions.size());
  std::vector<bool> used(cube.positions.size(), false);
  for (std::size_t i = 0; i < cube.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = cube.triangles[i][k];
      used[v] = true;
      EXPECT_EQ(cube.normals[v], face_normal(split, i));
      EXPECT_EQ(cube.positions[v], split.positions[split.triangles[i][k]]);
      EXPECT_EQ(cube.uvs[v], Vec2(cube.positions[v].x, cube.positions[v].y));
    }
  EXPECT_EQ(std::count(used.begin(), used.end(), true), 24);

  compute_normals(cube, 91);
  for (std::size_t v = 0; v < cube.positions.size(); ++v)
    if (used[v]) {
      EXPECT_LT((cube.normals[v] - cube.positions[v] / std::sqrt(3.0f)).length(), 1e-6f);
    }
}

TEST(Mesh, SmoothAngleKeepsRimOfCylinderSharp) {
  Mesh mesh = make_cylinder(Vec3(0), Vec3(0, 0, 2), 1, "test");
  const std::vector<Vec3> analytic = mesh.normals;
  const Mesh side = mesh;
  Mesh cap = make_disk();
  flip_normals(cap);
  const auto base = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), cap.positions.begin(), cap.positions.end());
  mesh.uvs.insert(mesh.uvs.end(), cap.uvs.begin(), cap.uvs.end());
  for (const Triangle& t : cap.triangles) mesh.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
  compute_normals(mesh, 30);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& n = mesh.normals[mesh.triangles[i][k]];
      const Vec3 expected = i < side.triangles.size() ? analytic[side.triangles[i][k]] : Vec3(0, 0, -1);
      EXPECT_LT((n - expected).length(), 2e-2f);
    }
}

TEST(Mesh, NormalsOfDegenerateMeshesAreUnit) {
  Mesh mesh = make_rectangle();
  mesh.triangles.push_back({0, 1, 1});  // a vertex twice
  mesh.triangles.push_back({2, 1, 0});  // cancels the first
  mesh.positions.push_back({5, 5, 5});  // unused
  mesh.positions.insert(mesh.positions.end(), 3, {7, 7, 7});
  mesh.triangles.push_back({5, 6, 7});  // a point
  for (const double angle : {0.0, 30.0, 180.0}) {
    compute_normals(mesh, angle);
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
    for (const Vec3& n : mesh.normals) EXPECT_NEAR(n.length(), 1, 1e-6);
  }
}

TEST(Mesh, NormalsOfHugeFanTakeLinearTime) {
  constexpr std::uint32_t kCount = 300'000;
  Mesh fan;
  fan.positions.emplace_back(0.0f, 0.0f, 1.0f);
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const double phi = 2 * kPiD * i / kCount;
    fan.positions.emplace_back(static_cast<float>(std::cos(phi)), static_cast<float>(std::sin(phi)), 0.0f);
    fan.triangles.push_back({0, 1 + i, 1 + (i + 1) % kCount});
  }
  compute_normals(fan, 10);  // hours, if all pairs of faces were compared
  EXPECT_LT((fan.normals[0] - Vec3(0, 0, 1)).length(), 1e-3f);
}

}  // namespace
}  // namespace nacre
