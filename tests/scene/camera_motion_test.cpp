// label: unit
// Turntables and key frames: where the camera is, and that it moves without a jolt.
#include "nacre/scene/camera_motion.h"

#include <gtest/gtest.h>

#include "nacre/geometry/primitives.h"
#include "scene/values.h"

namespace nacre {
namespace {

Vec3d origin(const Camera& camera) { return camera.to_world.translation(); }

Camera camera_at(const Vec3d& from, const Vec3d& to, const Vec3d& up) {
  Camera camera;
  camera.to_world = look_at(from, to, up).value();
  return camera;
}

// A translucent sphere beside the origin on a large floor.
Scene make_scene() {
  Scene scene;
  scene.media.emplace_back();
  Shape& ball = scene.shapes.emplace_back();
  ball.medium = 0;
  ball.mesh = make_sphere();
  Matrix4 beside;
  beside.setTranslation(Vec3d(3, 5, -2));
  transform_mesh(ball.mesh, beside, "ball");
  Shape& floor = scene.shapes.emplace_back();
  floor.mesh = make_rectangle();
  Matrix4 large;
  large.setScale(1000);
  transform_mesh(floor.mesh, large, "floor");
  return scene;
}

TEST(Turntable, GoesRoundWhatIsTranslucent) {
  const Camera camera = camera_at({3, 25, 38}, {3, 5, -2}, {0, 1, 0});
  const TurnAxis axis = find_turn_axis(make_scene(), camera);
  EXPECT_EQ(axis.direction, Vec3d(0, 1, 0));
  EXPECT_NEAR((axis.centre - Vec3d(3, 5, -2)).length(), 0, 1e-5);
  EXPECT_EQ(turn_camera(camera, axis, 0).to_world, camera.to_world);
  // Counter-clockwise from above: from the front to the right.
  EXPECT_NEAR((origin(turn_camera(camera, axis, 0.25)) - Vec3d(43, 25, -2)).length(), 0, 1e-5);
  const Camera behind = turn_camera(camera, axis, 0.5);
  const Matrix4 expected = look_at({3, 25, -42}, {3, 5, -2}, {0, 1, 0}).value();
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      EXPECT_NEAR(behind.to_world[row][column], expected[row][column], 1e-5);
}

TEST(Turntable, FollowsTheCamerasUp) {
  const Scene scene = make_scene();
  EXPECT_EQ(find_turn_axis(scene, camera_at({0, -40, 20}, {0, 0, 0}, {0, 0, 1})).direction, Vec3d(0, 0, 1));
  EXPECT_EQ(find_turn_axis(scene, camera_at({0, 0, 9}, {0, 0, 0}, {-1, 0.1, 0})).direction, Vec3d(-1, 0, 0));
}

TEST(Turntable, GoesRoundEverythingWhereNothingIsTranslucent) {
  Scene scene = make_scene();
  scene.shapes[0].medium = kNone;
  EXPECT_EQ(find_turn_axis(scene, camera_at({0, 9, 9}, {0, 0, 0}, {0, 1, 0})).centre.x, 0);
}

const std::vector<CameraKey> kKeys{{1, {0, 10, 100}, {0, 10, 0}, {0, 1, 0}, 40},
                                   {11, {40, 20, 80}, {0, 10, 0}, {0, 1, 0}, 40},
                                   {17, {60, 30, 20}, {5, 12, 0}, {0.2, 1, 0}, 20},
                                   {40, {60, 30, 20}, {5, 12, 0}, {0.2, 1, 0}, 20},
                                   {60, {0, 15, -70}, {0, 10, 0}, {0, 1, 0}, 0}};

TEST(CameraPath, HitsItsKeysToTheBit) {
  Camera camera;
  camera.fov = 33.25f;
  for (const CameraKey& key : kKeys) {
    const Camera moved = move_camera(camera, kKeys, key.frame, "");
    EXPECT_EQ(moved.to_world, look_at(key.origin, key.target, key.up).value()) << key.frame;
    EXPECT_EQ(moved.fov, key.fov > 0 ? static_cast<float>(key.fov) : 33.25f) << key.frame;
  }
  EXPECT_EQ(move_camera(camera, kKeys, -5, "").to_world, move_camera(camera, kKeys, 1, "").to_world);
  EXPECT_EQ(move_camera(camera, kKeys, 99, "").to_world, move_camera(camera, kKeys, 60, "").to_world);
}

// Frames ten thousand times as fine: the step from one to the next changes by next to nothing, at keys, too.
TEST(CameraPath, ChangesItsSpeedWithoutAJolt) {
  constexpr int kFine = 10'000;
  std::vector<CameraKey> keys = kKeys;
  for (CameraKey& key : keys) key.frame *= kFine;
  const auto speed = [&](int frame) {
    return (origin(move_camera({}, keys, frame + 1, "")) - origin(move_camera({}, keys, frame, ""))) *
           double{kFine};
  };
  for (const int frame : {11, 17, 40})
    EXPECT_NEAR((speed(frame * kFine) - speed(frame * kFine - 1)).length(), 0, 0.02) << frame;
  EXPECT_GT(speed(11 * kFine).length(), 1);
}

TEST(CameraPath, StandsStillBetweenEqualKeys) {
  for (int frame = 18; frame < 40; ++frame) {
    const Camera moved = move_camera({}, kKeys, frame, "");
    EXPECT_EQ(origin(moved), kKeys[2].origin);
    EXPECT_NEAR(moved.fov, 20, 1e-5);
  }
}

// Two keys make a straight line, evenly walked; zooms go by factors.
TEST(CameraPath, GoesStraightFromOneKeyToAnother) {
  const std::vector<CameraKey> keys{
      {0, {0, 0, 10}, {0, 0, 0}, {0, 1, 0}, 90},
      {10, {20, 0, 10}, {20, 0, 0}, {0, 1, 0}, 2 * std::atan(0.25) * 180 / kPiD}};
  const Camera middle = move_camera({}, keys, 5, "");
  EXPECT_NEAR((origin(middle) - Vec3d(10, 0, 10)).length(), 0, 1e-12);
  EXPECT_NEAR(std::tan(middle.fov * kPiD / 360), 0.5, 1e-6);
  EXPECT_NEAR(origin(move_camera({}, keys, 1, "")).x, 2, 1e-12);
}

// Keys on a parabola at any distances give that parabola.
TEST(CameraPath, IsSmoothOverUnevenKeys) {
  const auto at = [](double t) { return Vec3d(t, 5 + 0.01 * t * t, -50); };
  std::vector<CameraKey> keys;
  for (const int frame : {0, 10, 14, 30, 36}) keys.push_back({frame, at(frame), at(frame) + Vec3d(0, 0, 9)});
  for (int frame = 0; frame <= 36; ++frame)
    EXPECT_NEAR((origin(move_camera({}, keys, frame, "")) - at(frame)).length(), 0, 1e-9) << frame;
}

TEST(CameraPath, KeepsTheWidthOfAnOrthographicPicture) {
  Camera camera;
  camera.kind = CameraKind::kOrthographic;
  camera.to_world.setScale(Vec3d(7, 7, 1));
  const Camera moved = move_camera(camera, kKeys, 5, "");
  Vec3d left;
  moved.to_world.multDirMatrix(Vec3d(1, 0, 0), left);
  EXPECT_NEAR(left.length(), 7, 1e-12);
}

TEST(CameraPath, RefusesToLookNowhere) {
  const std::vector<CameraKey> keys{{0, {0, 0, 10}, {0, 0, 0}}, {2, {0, 0, -10}, {0, 0, 0}}};
  try {
    move_camera({}, keys, 1, "path.json");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kValue);
    EXPECT_NE(std::string(error.what()).find("path.json: at frame 1 the camera"), std::string::npos);
  }
}

}  // namespace
}  // namespace nacre
