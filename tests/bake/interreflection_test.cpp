// label: analytic
// Light between translucent surfaces: a hollow ball, whose inside is lit evenly by itself, and bodies that
// see each other or do not.
#include <gtest/gtest.h>

#include "nacre/bake/bake.h"
#include "nacre/base/random.h"
#include "nacre/base/sampling.h"
#include "nacre/cache/exitance.h"
#include "nacre/cache/nearest.h"
#include "nacre/optics/fresnel.h"
#include "transport/scene_parts.h"

namespace nacre {
namespace {

using namespace testing_support;

Medium make_test_medium() {
  Medium medium;
  medium.sigma_s = {1.0f, 1.5f, 2.0f};
  medium.sigma_a = {0.02f, 0.05f, 0.1f};
  medium.int_ior = 1.4f;
  medium.ext_ior = 1.0f;
  return medium;
}

Cache bake_with(const Scene& scene, bool interreflect) {
  BakeParams params;
  params.interreflect = interreflect;
  params.irradiance_samples = 64;
  params.bounces = 0;
  Progress progress;
  Report report;
  const World world = make_world(scene, true);
  return bake(world, plan_bake(scene, params), params, progress, report);
}

Vec3d mean_irradiance(const CacheGroup& group) {
  Vec3d sum(0, 0, 0);
  for (std::size_t i = 0; i < group.size(); ++i) sum += Vec3d(group.irradiance(i));
  return sum / static_cast<double>(group.size());
}

// Inside a sphere light leaves and arrives at the same angle, so that what arrives of M_o everywhere is
// M_o times 2 integral F_t(mu)^2 mu dmu; two rounds make the first terms of a geometric series.
TEST(HollowBall, AddsTwoTermsOfItsSeries) {
  Scene scene;
  const Medium medium = make_test_medium();
  add_shape(scene, placed(flipped(make_sphere()), 8, {0, 0, 0}), kNone, add_medium(scene, medium));
  add_point_light(scene, {0, 0, 0}, {100, 100, 100});
  const Cache plain = bake_with(scene, false), lit = bake_with(scene, true);
  const Vec3d before = mean_irradiance(plain.groups[0]), after = mean_irradiance(lit.groups[0]);

  const Exitance exitance(plain.groups[0], medium, 0);
  std::vector<Vec3> positions;
  for (std::size_t i = 0; i < plain.groups[0].size(); i += 97)
    positions.push_back(plain.groups[0].position(i));
  std::vector<Rgb> values(positions.size());
  std::uint64_t evaluations = 0;
  exitance.eval_exact(positions, values, evaluations);
  Vec3d mean(0, 0, 0);
  for (const Rgb& value : values) mean += Vec3d(value) / static_cast<double>(values.size());

  double exchange = 0;
  constexpr int kSteps = 10000;
  for (int i = 0; i < kSteps; ++i) {
    const double mu = (i + 0.5) / kSteps;
    exchange += 2 * square(1 - fresnel_reflectance(mu, static_cast<double>(medium.eta()))) * mu / kSteps;
  }
  for (int k = 0; k < 3; ++k) {
    const double factor = mean[k] / before[k] * exchange;
    EXPECT_GT(factor, 0.3) << k;
    EXPECT_NEAR(after[k] / before[k], 1 + factor + factor * factor, 0.015 * factor) << k;
  }
}

// A dark body receives light from a lit one beside it, and nothing from one behind a wall.
TEST(TwoBodies, LightEachOtherWhereTheySeeEachOther) {
  for (const bool wall : {false, true}) {
    Scene scene;
    add_shape(scene, placed(make_sphere(), 3, {-4, 0, 0}), kNone, add_medium(scene, make_test_medium()));
    add_shape(scene, placed(make_sphere(), 3, {4, 0, 0}), kNone, add_medium(scene, make_test_medium()));
    // Shade for the second from the lamp; without the wall both see each other below it.
    add_shape(scene, placed(make_cube(), Vec3(0.1f, 20, wall ? 20.0f : 4.0f),
                            {wall ? 0.5f : 0.6f, 0, wall ? 0.0f : 8.0f}));
    add_directional_light(scene, Vec3(0.8f, 0, -1), {1, 1, 1});
    const Cache plain = bake_with(scene, false), lit = bake_with(scene, true);
    const double before = mean_irradiance(plain.groups[1]).y, after = mean_irradiance(lit.groups[1]).y;
    if (wall)
      EXPECT_EQ(before, after);
    else
      EXPECT_GT(after, before + 1e-4);
  }
}

TEST(NearestSample, IsWhatAFullSearchFinds) {
  Scene scene;
  add_shape(scene, placed(make_cube(), Vec3(3, 3, 0.05f), {0, 0, 0}), kNone,
            add_medium(scene, make_test_medium()));
  add_directional_light(scene, {0, 0, -1}, {1, 1, 1});
  const Cache cache = bake_with(scene, false);
  const CacheGroup& group = cache.groups[0];
  for (std::uint32_t n = 0; n < 500; ++n) {
    const Vec2 u = sobol_2d(n, 1);
    const float side = n % 2 ? 1.0f : -1.0f;
    const Vec3 position(6 * u.x - 3, 6 * u.y - 3, 0.05f * side), normal(0, 0, side);
    float least = 1e30f;
    for (std::size_t i = 0; i < group.size(); ++i)
      if (dot(group.normal(i), normal) > 0.2f)
        least = std::min(least, (group.position(i) - position).length2());
    const std::size_t found = find_nearest_sample(group, position, normal);
    EXPECT_EQ((group.position(found) - position).length2(), least);
    EXPECT_GT(dot(group.normal(found), normal), 0.2f);
  }
}

}  // namespace
}  // namespace nacre
