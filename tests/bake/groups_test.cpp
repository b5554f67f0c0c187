// label: analytic
// Shapes of one medium scatter into each other, shapes of two never do; and surfaces of one medium that are
// no boundary of it.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>

#include "nacre/bake/bake.h"
#include "nacre/cache/cache_file.h"
#include "nacre/cache/exitance.h"
#include "nacre/scene/validity.h"
#include "transport/scene_parts.h"

namespace nacre {
namespace {

using namespace testing_support;

Medium marble(std::string id = "") {
  Medium medium = make_medium(*find_preset("Marble"));
  medium.scale = 5;
  medium.id = std::move(id);
  return medium;
}

Cache bake_scene(const Scene& scene, bool shadows = true) {
  BakeParams params;
  params.shadows = shadows;
  Progress progress;
  Report report;
  const World world = make_world(scene, shadows);
  return bake(world, plan_bake(scene, params), params, progress, report);
}

// Everywhere on the shapes of the scene.
std::vector<Vec3> points_on(const Scene& scene) {
  std::vector<Vec3> points;
  for (const Shape& shape : scene.shapes)
    for (std::size_t i = 0; i < shape.mesh.positions.size(); i += 1 + shape.mesh.positions.size() / 200)
      points.push_back(shape.mesh.positions[i]);
  return points;
}

double most(const CacheGroup& group, const Medium& medium, const std::vector<Vec3>& points, bool exact) {
  const Exitance exitance(group, medium, exact ? 0 : 0.01);
  std::vector<Rgb> values(points.size());
  std::uint64_t evaluations = 0;
  exact ? exitance.eval_exact(points, values, evaluations) : exitance.eval(points, values, evaluations);
  double result = 0;
  for (const Rgb& value : values) result = std::max(result, double{max_channel(value)});
  return result;
}

// A body in front that takes all the light, and one behind it in the dark.
Scene lit_and_dark(Mesh lit, Mesh dark, bool one_medium) {
  Scene scene;
  add_shape(scene, std::move(lit), kNone, add_medium(scene, marble("lit")));
  add_shape(scene, std::move(dark), kNone, one_medium ? 0 : add_medium(scene, marble("dark")));
  add_directional_light(scene, {1, 0, 0}, Rgb(1, 1, 1));
  return scene;
}

void expect_dark(const Scene& scene, const Cache& cache) {
  ASSERT_EQ(cache.groups.size(), 2u);
  const std::vector<Vec3> points = points_on(scene);
  for (const bool exact : {true, false}) {
    EXPECT_GT(most(cache.groups[0], scene.media[0], points, exact), 0.1) << exact;
    EXPECT_EQ(most(cache.groups[1], scene.media[1], points, exact), 0) << exact;
  }
}

// Both ways that two bodies can share space, baked and through one file.
TEST(Groups, NothingLeaksFromOneIntoAnother) {
  const std::pair<Mesh, Mesh> cases[] = {
      {placed(make_cube(), 1, {-1, 0, 0}), placed(make_cube(), 1, {1, 0, 0})},     // face on face
      {make_sphere(), placed(make_sphere(), 0.5f, {0.8f, 0, 0})},                  // through each other
      {placed(make_cube(), 1, {0, 0, 0}), placed(make_cube(), 0.5f, {0, 0, 0})}};  // one in the other
  for (const auto& [lit, dark] : cases) {
    const Scene scene = lit_and_dark(lit, dark, false);
    const Cache cache = bake_scene(scene);
    expect_dark(scene, cache);
    std::string folder = testing::TempDir() + "nacre_groups_XXXXXX";
    ASSERT_NE(mkdtemp(folder.data()), nullptr);
    save_cache(cache, folder + "/both.nacre");
    expect_dark(scene, load_cache(folder + "/both.nacre"));
    std::filesystem::remove_all(folder);
    EXPECT_TRUE(check_bodies(scene).empty());
  }
}

// The same bodies of one medium: light goes on where they touch.
TEST(Groups, BodiesOfOneMediumScatterIntoEachOther) {
  const Mesh lit = placed(make_cube(), 1, {-1, 0, 0}), dark = placed(make_cube(), 1, {1, 0, 0});
  const Scene scene = lit_and_dark(lit, dark, true);
  const Cache cache = bake_scene(scene);
  ASSERT_EQ(cache.groups.size(), 1u);
  EXPECT_GT(most(cache.groups[0], scene.media[0], dark.positions, true), 1e-4);
}

// Each group has the spacing of its own medium.
TEST(Groups, HaveTheirOwnDensity) {
  Scene scene = lit_and_dark(make_sphere(), placed(make_sphere(), 1, {3, 0, 0}), false);
  scene.media[1].sigma_s *= 0.5f;
  scene.media[1].sigma_a *= 0.5f;
  const Cache cache = bake_scene(scene);
  EXPECT_NEAR(static_cast<double>(cache.groups[0].size()) / static_cast<double>(cache.groups[1].size()), 4,
              0.05);
  EXPECT_GT(cache.groups[0].nodes.size(), 3 * cache.groups[1].nodes.size());
}

Scene lit_from_everywhere(const std::vector<Mesh>& meshes) {
  Scene scene;
  const int medium = add_medium(scene, marble());
  for (const Mesh& mesh : meshes) add_shape(scene, mesh, kNone, medium);
  for (int axis = 0; axis < 3; ++axis)
    for (const float side : {-1.0f, 1.0f}) {
      Vec3 direction(0, 0, 0);
      direction[axis] = side;
      add_directional_light(scene, direction, Rgb(1, 1, 1));
    }
  return scene;
}

double mean_exitance(const Scene& scene, bool shadows = true) {
  const Cache cache = bake_scene(scene, shadows);
  const Exitance exitance(cache.groups[0], scene.media[0], 0);
  std::vector<Vec3> points;
  const Mesh sphere = make_sphere();
  for (std::size_t i = 0; i < sphere.positions.size(); i += 97) points.push_back(sphere.positions[i]);
  std::vector<Rgb> values(points.size());
  std::uint64_t evaluations = 0;
  exitance.eval_exact(points, values, evaluations);
  double sum = 0;
  for (const Rgb& value : values) sum += double{value[1]};
  return sum / static_cast<double>(values.size());
}

bool warns(const Scene& scene, const std::string& text) {
  const Warnings warnings = check_bodies(scene);
  return warnings.size() == 1 && warnings[0].find(text) != std::string::npos;
}

TEST(Groups, ABodyInsideAnotherOfItsMediumStaysDark) {
  const Scene alone = lit_from_everywhere({make_sphere()});
  const Scene nested = lit_from_everywhere({make_sphere(), placed(make_cube(), 0.3f, {0, 0, 0})});
  EXPECT_TRUE(check_bodies(alone).empty());
  EXPECT_TRUE(warns(nested, "inside"));
  EXPECT_NEAR(mean_exitance(nested) / mean_exitance(alone), 1, 0.005);
  const Cache cache = bake_scene(nested);
  for (std::size_t i = 0; i < cache.groups[0].size(); ++i)
    if (cache.groups[0].position(i).length() < 0.9f) {
      EXPECT_TRUE(is_black(cache.groups[0].irradiance(i)));
    }
}

TEST(Groups, LightEntersACopyOnceMore) {
  const Scene copied = lit_from_everywhere({make_sphere(), make_sphere()});
  EXPECT_TRUE(warns(copied, "remove the copy"));
  EXPECT_NEAR(mean_exitance(copied) / mean_exitance(lit_from_everywhere({make_sphere()})), 2, 0.04);
}

TEST(Groups, ANearCopyTakesTheLightOfWhatIsBelow) {
  const Scene near = lit_from_everywhere({make_sphere(), placed(make_sphere(), 1.002f, {0, 0, 0})});
  EXPECT_TRUE(warns(near, "closer"));
  EXPECT_NEAR(mean_exitance(near) / mean_exitance(lit_from_everywhere({make_sphere()})), 1, 0.2);
}

// A large plate without thickness, lit from above: either side is the surface of the same half-space.
TEST(Groups, AShellWithoutThicknessIsAHalfSpaceFromEitherSide) {
  Scene sheet;
  add_shape(sheet, placed(make_rectangle(), 6, {0, 0, 0}), kNone, add_medium(sheet, marble()));
  add_directional_light(sheet, {0, 0, -1}, Rgb(1, 1, 1));
  Scene shell = sheet;
  add_shape(shell, flipped(placed(make_rectangle(), 6, {0, 0, 0})), kNone, 0);
  EXPECT_TRUE(check_bodies(sheet).empty());
  EXPECT_TRUE(warns(shell, "without thickness"));
  const std::vector<Vec3> middle{{0, 0, 0}, {0.1f, 0.2f, 0}, {-0.3f, 0.1f, 0}};
  const double of_sheet = most(bake_scene(sheet).groups[0], sheet.media[0], middle, true);
  EXPECT_NEAR(most(bake_scene(shell).groups[0], shell.media[0], middle, true) / of_sheet, 1, 0.02);
}

}  // namespace
}  // namespace nacre
