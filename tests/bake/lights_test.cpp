// label: analytic
// Baked light: how certain it is, one light at a time, and at other indices of refraction.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "nacre/bake/bake.h"
#include "nacre/cache/relight.h"
#include "transport/scene_parts.h"

namespace nacre {
namespace {

using namespace testing_support;

// A slab of marble under a lamp, a sun, a sky, and half a roof that shades them and sends light back.
Scene lit_scene(float int_ior = 1.5f) {
  Scene scene;
  Medium medium = make_medium(*find_preset("Marble"));
  medium.scale = 5;
  medium.int_ior = int_ior;
  medium.ext_ior = 1;
  add_shape(scene, make_rectangle(), kNone, add_medium(scene, medium));
  add_area_light(scene, flipped(placed(make_rectangle(), 0.4f, {0.5f, 0, 1.5f})), Rgb(3, 2, 1));
  scene.lights.back().id = "lamp";
  add_directional_light(scene, {0.5f, 0.3f, -1}, Rgb(0.2f, 0.5f, 1));
  scene.lights.back().id = "sun";
  add_constant_light(scene, Rgb(0.3f, 0.3f, 0.4f));
  scene.lights.back().id = "sky";
  add_shape(scene, placed(make_rectangle(), 0.5f, {-0.6f, 0, 0.5f}),
            add_diffuse(scene, Rgb(0.8f, 0.2f, 0.2f)));
  scene.surfaces.back().two_sided = true;
  return scene;
}

Cache run(const Scene& scene, const BakeParams& params) {
  Progress progress;
  Report report;
  return bake(make_world(scene, params.shadows), plan_bake(scene, params), params, progress, report);
}
BakeParams small(std::uint64_t seed = 0) {
  BakeParams params;
  params.points = 2000;
  params.irradiance_samples = 16;
  params.bounces = 1;
  params.seed = seed;
  return params;
}
double mean(const Rgb& c) { return (double{c.x} + double{c.y} + double{c.z}) / 3; }

// Two seeds place samples alike where only light is sampled anew, so their points are compared with those of
// many samples.
TEST(IrradianceError, IsWhatEstimatesDifferBy) {
  const Scene scene = lit_scene();
  const World world = make_world(scene, true);
  std::vector<Vec3> positions, normals;
  Rng rng(7);
  for (int i = 0; i < 1500; ++i) {
    positions.emplace_back(2 * rng.next_float() - 1, 2 * rng.next_float() - 1, 0.0f);
    normals.emplace_back(0.0f, 0.0f, 1.0f);
  }
  const std::vector<float> extents(positions.size(), 1.0f);
  Progress progress;
  const auto estimate = [&](int samples, std::uint64_t seed) {
    return compute_irradiance(world, {positions, normals, extents}, 1.5f, {samples, 1, 0, false, seed},
                              progress);
  };
  for (const int samples : {2, 7, 32}) {
    const SampleLight a = estimate(samples, 1), b = estimate(samples, 2);
    double predicted = 0, happened = 0;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      predicted += square(double{a.errors[i]}) + square(double{b.errors[i]});
      happened += square(mean(a.irradiance[i]) - mean(b.irradiance[i]));
    }
    EXPECT_GT(happened, 0);
    EXPECT_NEAR(std::sqrt(predicted / happened), 1, 0.12) << samples;
  }
  EXPECT_TRUE(estimate(1, 1).errors.empty());
}

TEST(IrradianceError, IsNoneOfLightFromOneDirection) {
  Scene scene = lit_scene();
  scene.shapes.resize(1);
  scene.lights.erase(scene.lights.begin());
  scene.lights.resize(1);
  BakeParams params = small();
  params.bounces = 0;
  const Cache cache = run(scene, params);
  for (const float error : cache.groups[0].lights[0].errors) EXPECT_EQ(error, 0);
}

TEST(IrradianceError, IsRefinedToWhatIsAskedFor) {
  const Scene scene = lit_scene();
  BakeParams params = small();
  // Of points that are not as good as dark, below a hundredth of the mean.
  const auto above = [](const Cache& cache, double error) {
    const CacheGroup& group = cache.groups[0];
    double sum = 0;
    for (std::size_t i = 0; i < group.size(); ++i) sum += mean(group.irradiance(i));
    const double dark = 0.01 * sum / static_cast<double>(group.size());
    std::size_t count = 0;
    for (std::size_t i = 0; i < group.size(); ++i)
      count += double{irradiance_error(group, i)} > error * std::max(mean(group.irradiance(i)), dark);
    return static_cast<double>(count) / static_cast<double>(group.size());
  };
  // At half of it, one point in fifty is so near an edge of shadow that 64 times as many samples do not do.
  constexpr double kError = 0.02;
  double before = 0, after = 0;
  for (const std::uint64_t seed : {0u, 1u, 2u, 3u}) {
    params = small(seed);
    before += above(run(scene, params), kError) / 4;
    params.irradiance_error = kError;
    after += above(run(scene, params), kError) / 4;
  }
  EXPECT_GT(before, 0.3);
  EXPECT_LT(after, 0.001);
}

TEST(PerLight, PlanesAddUpToTheBakeOfAll) {
  const Scene scene = lit_scene();
  BakeParams params = small();
  const Cache together = run(scene, params);
  params.per_light = true;
  const Cache apart = run(scene, params);
  const CacheGroup &a = together.groups[0], &b = apart.groups[0];
  ASSERT_EQ(a.size(), b.size());
  ASSERT_EQ(b.lights.size(), 3u);
  EXPECT_EQ(b.lights[0].name, "lamp");
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(b.irradiance(i)[k], a.irradiance(i)[k], 3e-6f * a.irradiance(i)[k]);
    Rgb sum(0, 0, 0);
    for (const LightPlane& light : b.lights)
      sum += Rgb(light.irradiance[0][i], light.irradiance[1][i], light.irradiance[2][i]);
    EXPECT_EQ(sum, b.irradiance(i));
  }
}

TEST(PerLight, GroupsOfLightsShareAPlane) {
  Scene scene = lit_scene();
  scene.lights[0].group = scene.lights[2].group = "soft";
  BakeParams params = small();
  params.per_light = true;
  const Cache cache = run(scene, params);
  ASSERT_EQ(cache.groups[0].lights.size(), 2u);
  EXPECT_EQ(cache.groups[0].lights[0].name, "soft");
  EXPECT_EQ(cache.groups[0].lights[1].name, "sun");
}

// Also of more lights than are all connected to, where they are chosen by chance.
TEST(PerLight, ScaledPlanesAreTheBakeOfScaledLights) {
  for (const int more : {0, 12}) {
    Scene scene = lit_scene();
    for (int i = 0; i < more; ++i)
      add_point_light(scene, {0.3f * static_cast<float>(i) - 2, 1, 1}, Rgb(0.1f, 0.2f, 0.1f));
    BakeParams params = small();
    params.bounces = 0;
    params.per_light = true;
    if (more > 0) params.irradiance_samples = 64;
    Cache cache = run(scene, params);
    relight(cache, std::vector<double>{cache.groups[0].eta},
            std::vector<LightScale>{{"lamp", {2, 0, 1}}, {"sky", {0, 0, 0}}});
    scale_light(scene.lights[0], {2, 0, 1});
    scale_light(scene.lights[2], {0, 0, 0});
    params.per_light = false;
    const Cache expected = run(scene, params);
    double difference = 0, sum = 0;
    for (std::size_t i = 0; i < expected.groups[0].size(); ++i)
      for (int k = 0; k < 3; ++k) {
        difference +=
            square(double{cache.groups[0].irradiance(i)[k]} - double{expected.groups[0].irradiance(i)[k]});
        sum += square(double{expected.groups[0].irradiance(i)[k]});
      }
    EXPECT_LT(std::sqrt(difference / sum), more > 0 ? 0.05 : 1e-6);
    for (int k = 0; k < 3 && more == 0; ++k)
      EXPECT_NEAR(cache.groups[0].nodes[0].power[k], expected.groups[0].nodes[0].power[k],
                  1e-5f * expected.groups[0].nodes[0].power[k]);
  }
}

TEST(EveryEta, ServesOtherIndicesAsIfBakedForThem) {
  const Cache reference = run(lit_scene(1.5f), small());
  for (const float eta : {1.0f, 1.05f, 1.2f, 1.4f, 1.8f, 2.0f}) {
    Cache cache = reference;
    ASSERT_TRUE(serves_eta(cache.groups[0], double{eta}));
    relight(cache, std::vector<double>{double{eta}}, {});
    const Cache expected = run(lit_scene(eta), small());
    for (std::size_t i = 0; i < expected.groups[0].size(); ++i)
      for (int k = 0; k < 3; ++k)
        ASSERT_NEAR(cache.groups[0].irradiance(i)[k], expected.groups[0].irradiance(i)[k],
                    2e-3f * expected.groups[0].irradiance(i)[k])
            << eta;
    EXPECT_EQ(cache.groups[0].nodes.size(), expected.groups[0].nodes.size());
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(cache.groups[0].nodes[0].power[k] / expected.groups[0].nodes[0].power[k], 1, 2e-3) << eta;
  }
}

TEST(EveryEta, IsLeftOutWhereItIsNotWantedOrCannotBe) {
  BakeParams params = small();
  params.fixed_eta = true;
  Cache cache = run(lit_scene(), params);
  EXPECT_TRUE(cache.groups[0].lights[0].ratios.empty());
  EXPECT_FALSE(serves_eta(cache.groups[0], 1.3));
  EXPECT_TRUE(serves_eta(cache.groups[0], 1.5));
  EXPECT_TRUE(run(lit_scene(2.5f), small()).groups[0].lights[0].ratios.empty());
  params = small();
  params.interreflect = true;
  EXPECT_TRUE(run(lit_scene(), params).groups[0].lights[0].ratios.empty());
}

TEST(Relight, LeavesAloneWhatDoesNotChange) {
  const Cache baked = run(lit_scene(), small());
  Cache cache = baked;
  relight(cache, std::vector<double>{1.5}, std::vector<LightScale>{{"", {1, 1, 1}}});
  EXPECT_EQ(cache.groups[0].nodes.data(), baked.groups[0].nodes.data());
  EXPECT_EQ(cache.groups[0].planes[7].data(), baked.groups[0].planes[7].data());
}

TEST(Relight, ScalesErrorsWithTheLight) {
  const Cache baked = run(lit_scene(), small());
  Cache cache = baked;
  relight(cache, std::vector<double>{1.5}, std::vector<LightScale>{{"", {3, 3, 3}}});
  for (std::size_t i = 0; i < 100; ++i) {
    EXPECT_EQ(cache.groups[0].irradiance(i), baked.groups[0].irradiance(i) * 3.0f);
    EXPECT_NEAR(irradiance_error(cache.groups[0], i), 3 * irradiance_error(baked.groups[0], i),
                1e-5f * irradiance_error(cache.groups[0], i));
  }
}

}  // namespace
}  // namespace nacre
