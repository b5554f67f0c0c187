// label: unit
// Plans of bakes, their limits and errors, and whole bakes through the cache file.
#include "nacre/bake/bake.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <numeric>

#include "nacre/base/error.h"
#include "nacre/base/parallel.h"
#include "nacre/cache/cache_file.h"
#include "nacre/cache/fingerprint.h"
#include "transport/scene_parts.h"

namespace nacre {
namespace {

using namespace testing_support;

Medium medium_of(const char* preset, float scale, std::string id = "") {
  Medium medium = make_medium(*find_preset(preset));
  medium.scale = scale;
  medium.id = std::move(id);
  medium.place = "scene.xml:3";
  return medium;
}
double path_units(const Medium& medium) {
  return static_cast<double>(smallest_mean_free_path(medium)) / static_cast<double>(medium.scale);
}

// A plane of marble, 4 units^2, lit from above.
Scene marble_scene(float scale = 5) {
  Scene scene;
  scene.path = "scene.xml";
  add_shape(scene, make_rectangle(), kNone, add_medium(scene, medium_of("Marble", scale, "stone")));
  add_directional_light(scene, {0, 0, -1}, Rgb(1, 1, 1));
  return scene;
}
// Next to it, a sphere and a cube of one other medium.
Scene two_media() {
  Scene scene = marble_scene();
  const int skin = add_medium(scene, medium_of("Skin1", 10));
  add_shape(scene, placed(make_sphere(), 1, {4, 0, 0}), kNone, skin);
  add_shape(scene, placed(make_cube(), 0.5f, {8, 0, 0}), kNone, skin);
  return scene;
}

Cache run(const Scene& scene, const BakeParams& params, Report& report) {
  Progress progress;
  const World world = make_world(scene, params.shadows);
  return bake(world, plan_bake(scene, params), params, progress, report);
}
Cache run(const Scene& scene, const BakeParams& params) {
  Report report;
  return run(scene, params, report);
}

Error error_of(const Scene& scene, const BakeParams& params) {
  try {
    plan_bake(scene, params);
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "no error";
  return Error(ErrorCode::kIo, "", "");
}

TEST(PlanBake, DefaultSpacingFollowsTheShortestPath) {
  const Scene scene = marble_scene();
  const BakePlan plan = plan_bake(scene, {});
  ASSERT_EQ(plan.groups.size(), 1u);
  const GroupPlan& group = plan.groups[0];
  EXPECT_EQ(group.name, "stone");
  EXPECT_NEAR(group.surface_area, 4, 1e-6);
  const double path = 1 / 3.0071;  // marble's blue, mm
  EXPECT_NEAR(group.spacing_mm, 0.65 * path, 1e-5);
  EXPECT_NEAR(group.points, 2 / std::sqrt(3.0) * (4 * 25) / square(0.65 * path), 1);
  EXPECT_NEAR(group.points / (4 * 25 / square(path)), 2.73, 0.01);
  EXPECT_EQ(plan.points, group.points);
  EXPECT_EQ(group.irradiance_samples, kDefaultIrradianceSamples);
  EXPECT_EQ(group.bounces, 1);
}

TEST(PlanBake, SpacingIsInMillimetres) {
  for (const float scale : {1.0f, 5.0f}) {
    BakeParams params;
    params.spacing_mm = 0.1;
    const BakePlan plan = plan_bake(marble_scene(scale), params);
    EXPECT_NEAR(plan.groups[0].spacing_mm, 0.1, 1e-9);
    EXPECT_NEAR(plan.points, 2 / std::sqrt(3.0) * 4 * square(static_cast<double>(scale)) / 0.01,
                1e-6 * plan.points);
  }
}

TEST(PlanBake, PointsAreSharedOutByAreaInMeanFreePaths) {
  const Scene scene = two_media();
  BakeParams params;
  params.points = 10000;
  const BakePlan plan = plan_bake(scene, params);
  ASSERT_EQ(plan.groups.size(), 2u);
  EXPECT_EQ(plan.groups[1].name, medium_name(scene, 1));
  EXPECT_NEAR(plan.points, 10000, 1e-6);
  EXPECT_NEAR(plan.groups[1].surface_area, 4 * kPiD + 6, 0.01);
  const double marble = plan.groups[0].surface_area / square(path_units(scene.media[0]));
  const double skin = plan.groups[1].surface_area / square(path_units(scene.media[1]));
  EXPECT_NEAR(plan.groups[0].points / plan.groups[1].points, marble / skin, 1e-6 * marble / skin);
  // The same spacing in mean free paths.
  EXPECT_NEAR(plan.groups[0].spacing_mm / static_cast<double>(smallest_mean_free_path(scene.media[0])),
              plan.groups[1].spacing_mm / static_cast<double>(smallest_mean_free_path(scene.media[1])), 1e-6);
}

TEST(PlanBake, SampleMultiplierMultipliesTheDefault) {
  Scene scene = marble_scene();
  const double points = plan_bake(scene, {}).points;
  scene.subsurface[0].sample_multiplier = 4;
  EXPECT_NEAR(plan_bake(scene, {}).points, 4 * points, 1e-6 * points);
  BakeParams params;
  params.spacing_mm = 0.5;
  const double explicit_points = plan_bake(scene, params).points;
  scene.subsurface[0].sample_multiplier = 1;
  EXPECT_EQ(plan_bake(scene, params).points, explicit_points);
  params.spacing_mm.reset();
  params.points = 777;
  EXPECT_NEAR(plan_bake(scene, params).points, 777, 1e-9);
}

TEST(PlanBake, SamplesAndBouncesComeFromTheSceneUnlessGiven) {
  Scene scene = marble_scene();
  scene.integrator = {IntegratorKind::kPath, 1, 6};
  scene.subsurface[0].irradiance_samples = 17;
  EXPECT_EQ(plan_bake(scene, {}).groups[0].bounces, 4);
  EXPECT_EQ(plan_bake(scene, {}).groups[0].irradiance_samples, 17);
  scene.subsurface[0].indirect = false;
  EXPECT_EQ(plan_bake(scene, {}).groups[0].bounces, 0);
  BakeParams params;
  params.bounces = 2;
  params.irradiance_samples = 5;
  EXPECT_EQ(plan_bake(scene, params).groups[0].bounces, 2);
  EXPECT_EQ(plan_bake(scene, params).groups[0].irradiance_samples, 5);
}

// A body far smaller than a mean free path still has a lit and a dark side.
TEST(PlanBake, SmallBodiesGetEnoughSamplesToShadeThem) {
  const BakePlan plan = plan_bake(marble_scene(1e-3f), {});
  EXPECT_EQ(plan.groups[0].points, kFewestPoints);
  EXPECT_GT(plan_bake(marble_scene(100), {}).groups[0].points, 10 * kFewestPoints);
}

TEST(PlanBake, EveryGroupGetsASample) {
  BakeParams params;
  params.points = 1;
  const BakePlan plan = plan_bake(two_media(), params);
  EXPECT_GE(plan.groups[0].points, 1);
  EXPECT_GE(plan.groups[1].points, 1);
  EXPECT_NEAR(plan.points, plan.groups[0].points + plan.groups[1].points, 1e-9);
}

TEST(PlanBake, LeavesOutWhatIsTakenForOpaque) {
  Scene scene = two_media();
  scene.media[0].lambert = true;
  BakeParams params;
  EXPECT_EQ(plan_bake(scene, params).groups[0].points, 1);
  EXPECT_GT(plan_bake(scene, params).groups[1].points, 100);
  params.points = 500;
  EXPECT_NEAR(plan_bake(scene, params).groups[1].points, 500, 1e-6);
  scene.media[1].lambert = true;
  EXPECT_EQ(plan_bake(scene, params).points, 2);
  EXPECT_EQ(run(scene, params).groups.size(), 2u);
}

TEST(PlanBake, RefusesTooManySamples) {
  using Limits = std::numeric_limits<double>;
  for (const double points : {2.01e8, 1e300, Limits::infinity(), Limits::quiet_NaN()}) {
    BakeParams params;
    params.points = points;
    const Error error = error_of(marble_scene(), params);
    EXPECT_EQ(error.code(), ErrorCode::kLimit);
    EXPECT_NE(error.reason().find("200 million"), std::string::npos);
    EXPECT_NE(error.reason().find("scale"), std::string::npos);
  }
  // The usual way to get there: a scale that makes a huge object.
  const Error error = error_of(marble_scene(100000), {});
  EXPECT_EQ(error.code(), ErrorCode::kLimit);
  EXPECT_EQ(error.place(), "scene.xml");
  BakeParams params;
  params.spacing_mm = 1e-200;
  EXPECT_EQ(error_of(marble_scene(), params).code(), ErrorCode::kLimit);
  params.spacing_mm.reset();
  params.points = 2e8;
  EXPECT_EQ(plan_bake(marble_scene(), params).points, 2e8);
}

TEST(PlanBake, RefusesScenesWithNothingToBake) {
  Scene opaque;
  opaque.path = "plain.xml";
  add_shape(opaque, make_rectangle());
  const Error none = error_of(opaque, {});
  EXPECT_EQ(none.code(), ErrorCode::kValue);
  EXPECT_EQ(none.place(), "plain.xml");
  EXPECT_NE(none.reason().find("translucent"), std::string::npos);

  Scene flat = marble_scene();
  flat.shapes[0].mesh.positions.assign(4, Vec3(1, 1, 1));
  const Error empty = error_of(flat, {});
  EXPECT_EQ(empty.code(), ErrorCode::kValue);
  EXPECT_EQ(empty.place(), "scene.xml:3");
  EXPECT_NE(empty.reason().find("stone"), std::string::npos);

  Scene vacuum = marble_scene();
  vacuum.media[0].sigma_s = vacuum.media[0].sigma_a = Rgb(0, 0, 0);
  EXPECT_EQ(error_of(vacuum, {}).code(), ErrorCode::kValue);
}

TEST(PlanBake, PredictsTheFileSize) {
  BakeParams params;
  params.points = 50000;
  const BakePlan plan = plan_bake(marble_scene(), params);
  const std::string path = testing::TempDir() + "nacre_bake_size_XXXXXX";
  std::string folder = path;
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  save_cache(run(marble_scene(), params), folder + "/a.nacre");
  const auto size = static_cast<double>(std::filesystem::file_size(folder + "/a.nacre"));
  EXPECT_NEAR(plan.bytes / size, 1, 0.3);
  std::filesystem::remove_all(folder);
}

double sum(std::span<const float> values) { return std::accumulate(values.begin(), values.end(), 0.0); }

TEST(Bake, FillsEveryGroup) {
  const Scene scene = two_media();
  BakeParams params;
  params.points = 6000;
  params.bounces = 0;
  Report report;
  const BakePlan plan = plan_bake(scene, params);
  const Cache cache = run(scene, params, report);
  ASSERT_EQ(cache.groups.size(), 2u);
  std::size_t points = 0, nodes = 0;
  for (std::size_t m = 0; m < 2; ++m) {
    const CacheGroup& group = cache.groups[m];
    EXPECT_EQ(group.name, plan.groups[m].name);
    EXPECT_NEAR(static_cast<double>(group.size()) / plan.groups[m].points, 1, 0.05);
    EXPECT_NEAR(group.surface_area / plan.groups[m].surface_area, 1, 1e-6);
    EXPECT_NEAR(sum(group.plane(Plane::kArea)) / group.surface_area, 1, 1e-3);
    points += group.size();
    nodes += group.nodes.size();
  }
  EXPECT_EQ(report.counts.at("points"), points);
  EXPECT_EQ(report.counts.at("octree_nodes"), nodes);
  for (const char* stage : {"place_samples", "irradiance", "build_octree"})
    EXPECT_EQ(report.seconds.count(stage), 1u) << stage;
  // The plane faces the light everywhere: E_t is the transmittance at normal incidence.
  const double eta = static_cast<double>(scene.media[0].eta());
  for (const float e : cache.groups[0].plane(Plane::kIrradianceG))
    EXPECT_NEAR(e, 1 - square((eta - 1) / (eta + 1)), 1e-4);
  // What faces away from it is dark.
  const CacheGroup& other = cache.groups[1];
  for (std::size_t i = 0; i < other.size(); ++i)
    EXPECT_EQ(other.irradiance(i).x > 0, other.normal(i).z > 0) << other.position(i).z;
}

TEST(Bake, GroupsOfOneMediumAreOne) {
  Scene scene = marble_scene();
  add_shape(scene, placed(make_rectangle(), 1, {5, 0, 0}), kNone, 0);
  BakeParams params;
  params.points = 2000;
  const Cache cache = run(scene, params);
  ASSERT_EQ(cache.groups.size(), 1u);
  EXPECT_NEAR(cache.groups[0].surface_area, 8, 1e-6);
  std::size_t left = 0;
  for (const float x : cache.groups[0].plane(Plane::kX)) left += x < 2.5f;
  EXPECT_NEAR(static_cast<double>(left) / static_cast<double>(cache.groups[0].size()), 0.5, 0.02);
}

bool same_numbers(const Cache& a, const Cache& b) {
  if (a.groups.size() != b.groups.size()) return false;
  for (std::size_t m = 0; m < a.groups.size(); ++m)
    for (std::size_t p = 0; p < kPlaneCount; ++p)
      if (!std::ranges::equal(a.groups[m].planes[p], b.groups[m].planes[p])) return false;
  return true;
}

TEST(Bake, DependsOnSeedButNotOnThreads) {
  Scene scene = two_media();
  add_area_light(scene, placed(flipped(make_rectangle()), 1, {0, 0, 5}), Rgb(1, 1, 1));
  BakeParams params;
  params.points = 4000;
  params.irradiance_samples = 4;
  std::unique_ptr<Cache> one, two;
  {
    const ThreadLimit limit(1);
    one = std::make_unique<Cache>(run(scene, params));
  }
  {
    const ThreadLimit limit(2);
    two = std::make_unique<Cache>(run(scene, params));
  }
  EXPECT_TRUE(same_numbers(*one, *two));
  EXPECT_EQ(one->fingerprint, two->fingerprint);
  params.seed = 1;
  EXPECT_FALSE(same_numbers(*one, run(scene, params)));
}

TEST(Bake, IsTheSameAfterSavingAndLoading) {
  const Scene scene = two_media();
  BakeParams params;
  params.points = 3000;
  params.seed = 42;
  const Cache baked = run(scene, params);
  std::string folder = testing::TempDir() + "nacre_bake_XXXXXX";
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  save_cache(baked, folder + "/a.nacre");
  {
    const Cache loaded = load_cache(folder + "/a.nacre");
    EXPECT_TRUE(same_numbers(baked, loaded));
    EXPECT_EQ(loaded.fingerprint, baked.fingerprint);
    EXPECT_EQ(loaded.info, baked.info);
    for (std::size_t m = 0; m < 2; ++m) {
      EXPECT_EQ(loaded.groups[m].name, baked.groups[m].name);
      EXPECT_EQ(loaded.groups[m].surface_area, baked.groups[m].surface_area);
      EXPECT_EQ(loaded.groups[m].nodes.size(), baked.groups[m].nodes.size());
    }
    EXPECT_NE(std::ranges::find(loaded.info, std::pair<std::string, std::string>("seed", "42")),
              loaded.info.end());
  }
  std::filesystem::remove_all(folder);
}

TEST(Bake, FingerprintIsThatOfTheScene) {
  const Scene scene = two_media();
  BakeParams params;
  params.points = 100;
  params.bounces = 2;
  const Cache cache = run(scene, params);
  EXPECT_EQ(describe_mismatch(cache.fingerprint, make_fingerprint(scene, {{2, 2}, true, false, true})), "");
  EXPECT_NE(describe_mismatch(cache.fingerprint, make_fingerprint(scene, {{2, 1}, true, false, true})), "");
  EXPECT_NE(describe_mismatch(cache.fingerprint, make_fingerprint(scene, {{2, 2}, false, false, true})), "");
}

}  // namespace
}  // namespace nacre
