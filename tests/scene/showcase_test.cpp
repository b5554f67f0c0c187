// label: unit
// The scene around a single mesh file.
#include <set>

#include "nacre/geometry/mesh_file.h"
#include "nacre/geometry/primitives.h"
#include "scene/scene_text.h"

namespace nacre {
namespace {

Medium marble() { return make_medium(*find_preset("Marble")); }

// An octahedron, off centre and 2 units tall.
constexpr const char* kOctahedron =
    "v 11 0 0\nv 9 0 0\nv 10 1 0\nv 10 -1 0\nv 10 0 1\nv 10 0 -1\n"
    "f 3 5 1\nf 3 1 6\nf 3 6 2\nf 3 2 5\nf 4 1 5\nf 4 6 1\nf 4 2 6\nf 4 5 2\n";

// The whole built-in sphere, or half of its triangles.
std::string write_sphere(const SceneFolder& folder, bool whole = true) {
  Mesh mesh = make_sphere();
  if (!whole) mesh.triangles.resize(mesh.triangles.size() / 2);
  const std::string path = folder.path() + "/sphere.ply";
  save_mesh(mesh, path);
  return path;
}

TEST(Showcase, TheObjectStandsOnTheFloorAtItsHeight) {
  const SceneFolder folder;
  const std::string path = write_sphere(folder);
  Medium medium = marble();
  medium.scale = 7;
  const Scene scene = make_showcase_scene(path, medium, 50);
  const Box3 box = bounds(scene.shapes.at(0).mesh);
  EXPECT_NEAR(box.min.y, 0, 1e-4);
  EXPECT_NEAR(box.max.y, 50, 1e-3);
  EXPECT_NEAR(box.min.x + box.max.x, 0, 1e-3);
  ASSERT_EQ(scene.media.size(), 1u);
  EXPECT_EQ(scene.subsurface.size(), 1u);
  EXPECT_EQ(scene.media[0].scale, 1);
  EXPECT_EQ(scene.shapes[0].medium, 0);
  EXPECT_EQ(count_warnings(scene, "translucent"), 0);
}

TEST(Showcase, TheCameraSeesTheObjectAndTheFloorButNoLight) {
  const SceneFolder folder;
  for (const double height : {0.01, 50.0, 1e5}) {
    const Scene scene = make_showcase_scene(write_sphere(folder), marble(), height);
    const Camera& camera = scene.cameras.at(0);
    const double tangent = std::tan(camera.fov * kPiD / 360);
    const Matrix4 to_camera = camera.to_world.inverse();
    const auto reach = [&](const Vec3& p) {
      const Vec3d seen = Vec3d(p) * to_camera;
      return seen.z <= 0 ? 1e9 : std::max(std::abs(seen.x), std::abs(seen.y)) / (tangent * seen.z);
    };
    double largest = 0;
    for (const Vec3& p : scene.shapes[0].mesh.positions) largest = std::max(largest, reach(p));
    EXPECT_LT(largest, 1);
    EXPECT_GT(largest, 0.6);
    for (const Light& light : scene.lights)
      for (const Vec3& p : scene.shapes[std::get<AreaLight>(light.model).shape].mesh.positions)
        EXPECT_GT(reach(p), 1) << light.id;
    const Shape& floor = scene.shapes.at(1);
    EXPECT_EQ(floor.id, "floor");
    EXPECT_EQ(bounds(floor.mesh).min.y, 0);
    EXPECT_GT(bounds(floor.mesh).max.z, camera.to_world[3][2]);
    EXPECT_GT(face_normal(floor.mesh, 0).y, 0.99f);
    for (std::size_t i = 0; i < floor.mesh.triangles.size(); ++i) {
      const Vec3 to_eye =
          Vec3(camera.to_world.translation()) - floor.mesh.positions[floor.mesh.triangles[i][0]];
      EXPECT_GT(dot(face_normal(floor.mesh, i), to_eye), 0) << i;
    }
  }
}

TEST(Showcase, LightsFaceTheObject) {
  const SceneFolder folder;
  const Scene scene = make_showcase_scene(write_sphere(folder), marble(), 10);
  std::set<std::string> ids;
  for (const Light& light : scene.lights) {
    ids.insert(light.id);
    const Mesh& mesh = scene.shapes[std::get<AreaLight>(light.model).shape].mesh;
    EXPECT_GT(dot(face_normal(mesh, 0), Vec3(0, 5, 0) - mesh.positions[0]), 0);
  }
  EXPECT_EQ(ids, (std::set<std::string>{"fill", "key"}));
}

TEST(Showcase, CoarseSmoothMeshesAreSubdividedAngularOnesAreNot) {
  const SceneFolder folder;
  // Every edge of an octahedron folds by 70.5 degrees, those of a globe by at most 21.
  const std::string angular = folder.write("octahedron.obj", kOctahedron);
  EXPECT_EQ(make_showcase_scene(angular, marble(), 10).shapes[0].mesh.triangles.size(), 8u);

  constexpr int kRings = 12, kSectors = 24;
  std::string ball = "v 0 1 0\nv 0 -1 0\n";
  for (int i = 1; i < kRings; ++i)
    for (int k = 0; k < kSectors; ++k)
      ball += fmt::format("v {} {} {}\n", std::sin(kPiD * i / kRings) * std::cos(2 * kPiD * k / kSectors),
                          std::cos(kPiD * i / kRings),
                          -std::sin(kPiD * i / kRings) * std::sin(2 * kPiD * k / kSectors));
  const auto index = [](int ring, int sector) { return 3 + (ring - 1) * kSectors + sector % kSectors; };
  for (int k = 0; k < kSectors; ++k) {
    ball += fmt::format("f 1 {} {}\n", index(1, k), index(1, k + 1));
    ball += fmt::format("f 2 {} {}\n", index(kRings - 1, k + 1), index(kRings - 1, k));
    for (int i = 1; i < kRings - 1; ++i)
      ball +=
          fmt::format("f {} {} {} {}\n", index(i, k), index(i + 1, k), index(i + 1, k + 1), index(i, k + 1));
  }
  const Scene scene = make_showcase_scene(folder.write("ball.obj", ball), marble(), 10);
  EXPECT_GE(scene.shapes[0].mesh.triangles.size(), 50'000u);
  EXPECT_LT(scene.shapes[0].mesh.triangles.size(), 200'000u);
  EXPECT_TRUE(scene.warnings.empty()) << scene.warnings[0];
}

TEST(Showcase, BadInputIsRefused) {
  const SceneFolder folder;
  const std::string good = folder.write("good.obj", kOctahedron);
  for (const double height : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_THROW(make_showcase_scene(good, marble(), height), Error) << height;
  const std::string flat = folder.write("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 3 2\n");
  EXPECT_THROW(make_showcase_scene(flat, marble(), 10), Error);
  EXPECT_THROW(make_showcase_scene(folder.path() + "/none.obj", marble(), 10), Error);
  EXPECT_THROW(make_showcase_scene(folder.write("empty.obj", ""), marble(), 10), Error);
}

TEST(Showcase, AnOpenMeshIsWarnedOf) {
  const SceneFolder folder;
  const Scene scene = make_showcase_scene(write_sphere(folder, false), marble(), 10);
  EXPECT_EQ(count_warnings(scene, "the mesh is translucent, but "), 1);
}

}  // namespace
}  // namespace nacre
