// label: image
// Films do not flicker: what leaves a point of the surface by diffusion is the same whichever camera sees it,
// and whatever was rendered before.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "nacre/bake/bake.h"
#include "nacre/geometry/mesh_file.h"
#include "nacre/geometry/primitives.h"
#include "nacre/render/camera.h"
#include "nacre/render/render.h"
#include "nacre/scene/camera_motion.h"
#include "nacre/scene/scene_file.h"
#include "render/translucency.h"

namespace nacre {
namespace {

constexpr int kFrames = 4;

// A marble sphere with bumps, and the cameras of a turntable of which a few frames are made.
class Flicker : public testing::Test {
 protected:
  Flicker() : scene_(make_film_scene()), world_(make_world(scene_, true)) {
    BakeParams params;
    params.points = 20'000;
    params.irradiance_samples = 4;
    cache_ = bake(world_, plan_bake(scene_, params), params, progress_, report_);
  }

  static Scene make_film_scene() {
    std::string folder = (std::filesystem::path(testing::TempDir()) / "nacre-flicker-XXXXXX").string();
    if (!::mkdtemp(folder.data())) throw std::runtime_error("no folder");
    Mesh mesh = make_sphere();
    for (Vec3& p : mesh.positions) p *= 1 + 0.1f * std::sin(7 * p.x) * std::sin(6 * p.y) * std::sin(5 * p.z);
    mesh.normals.clear();
    save_mesh(mesh, folder + "/bumps.obj");
    Scene scene = make_showcase_scene(folder + "/bumps.obj", make_medium(*find_preset("Marble")), 20);
    std::filesystem::remove_all(folder);
    const TurnAxis axis = find_turn_axis(scene, scene.cameras[0]);
    for (int i = 1; i < kFrames; ++i) {
      scene.cameras.push_back(turn_camera(scene.cameras[0], axis, i * 0.06));
      scene.films.push_back(scene.films[0]);
    }
    return scene;
  }

  RenderParams frame(int i) const {
    RenderParams params = default_render_params(scene_, static_cast<std::size_t>(i));
    params.width = params.height = params.crop_width = params.crop_height = 64;
    params.samples_per_pixel = 2;
    params.single_samples = 1;
    return params;
  }

  std::vector<Image> render_frames(const std::vector<int>& frames) {
    const Renderer renderer(world_, cache_, frame(0), report_);
    std::vector<Image> images(kFrames);
    for (const int i : frames)
      images[static_cast<std::size_t>(i)] = renderer.render(frame(i), progress_, report_, warnings_);
    return images;
  }

  Progress progress_;
  Report report_;
  Warnings warnings_;
  Scene scene_;
  World world_;
  Cache cache_;
};

TEST_F(Flicker, FramesAreTheSameInAnyOrderAndAlone) {
  const std::vector<Image> film = render_frames({0, 1, 2, 3}), backwards = render_frames({3, 2, 1, 0});
  const std::vector<Image> alone = render_frames({2});
  for (const std::string& layer : layer_names(film[2])) {
    for (std::size_t i = 0; i < kFrames; ++i)
      EXPECT_TRUE(compare_images(film[i], backwards[i], layer).identical) << layer << " " << i;
    EXPECT_TRUE(compare_images(film[2], alone[2], layer).identical) << layer;
  }
  EXPECT_FALSE(compare_images(film[1], film[2], "diffusion").identical);
}

TEST_F(Flicker, PointsSendTheSameToEveryCamera) {
  const RenderParams params = frame(0);
  // What each camera sees at the middles of pixels, and the same points as the camera of the next frame sees
  // them: the place differs by rounding alone.
  std::vector<Hit> here, there;
  const CameraRays camera(scene_.cameras[0], params.width, params.height);
  const Vec3 next_eye(scene_.cameras[1].to_world.translation());
  for (int y = 0; y < params.height; ++y)
    for (int x = 0; x < params.width; ++x) {
      const Hit hit = world_.tracer.intersect(
          camera.at({static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f}, {0.5f, 0.5f}));
      if (!hit || world_.shape(hit).medium == kNone) continue;
      const Vec3 seen = surface_point(world_, hit).position;
      const Hit again = world_.tracer.intersect({next_eye, (seen - next_eye).normalized(), 0, 1e9f});
      if (!again || again.mesh != hit.mesh || again.triangle != hit.triangle) continue;
      here.push_back(hit);
      there.push_back(again);
    }
  ASSERT_GT(here.size(), 500u);

  const auto eval = [&](const Translucency& medium, const std::vector<Hit>& hits) {
    std::vector<ExitPoint> points;
    for (const Hit& hit : hits) points.push_back({hit, surface_point(world_, hit), {0, 0, 1}, 0, 0});
    std::vector<Rgb> exitance(hits.size());
    std::uint64_t evaluations = 0;
    medium.eval_diffusion(hits, points, exitance, evaluations);
    return exitance;
  };
  const Translucency film(world_, 0, MaterialFamily{{scene_.media[0]}}, &cache_.groups[0], params);
  const std::vector<Rgb> first = eval(film, here), second = eval(film, there);
  const Translucency other(world_, 0, MaterialFamily{{scene_.media[0]}}, &cache_.groups[0], params);
  EXPECT_EQ(eval(other, there), second);
  EXPECT_EQ(eval(other, here), first);
  for (std::size_t i = 0; i < first.size(); ++i)
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(second[i][k], first[i][k], 1e-4f * first[i][k]) << i;
}

}  // namespace
}  // namespace nacre
