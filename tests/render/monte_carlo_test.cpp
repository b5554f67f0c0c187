// label: image
// The brute-force estimate of diffusion against closed forms and against the sum over the cache, and the
// opaque approximation.
#include "nacre/render/monte_carlo.h"

#include <gtest/gtest.h>

#include "../transport/scene_parts.h"
#include "nacre/bake/bake.h"
#include "nacre/base/random.h"
#include "nacre/optics/fresnel.h"
#include "nacre/optics/profile.h"
#include "nacre/render/render.h"

namespace nacre {
namespace {

using namespace testing_support;

Medium make_test_medium() {
  Medium medium;
  medium.id = "medium";
  medium.sigma_s = {1.0f, 1.5f, 3.0f};
  medium.sigma_a = {0.1f, 0.2f, 0.15f};
  medium.int_ior = 1.4f;
  medium.ext_ior = 1.0f;
  return medium;
}

// Looks along -z from above, at `width` scene units.
void add_camera(Scene& scene, const Vec3& eye, float width, int pixels) {
  Camera camera;
  camera.id = "camera";
  // +x of the camera to the left of the picture, forward down.
  const Vec3 forward(0, 0, -1), left(-1, 0, 0), up(0, 1, 0);
  for (int k = 0; k < 3; ++k) {
    camera.to_world[0][k] = left[k];
    camera.to_world[1][k] = up[k];
    camera.to_world[2][k] = forward[k];
    camera.to_world[3][k] = eye[k];
  }
  camera.fov = 2 * std::atan(width / 2 / eye.z) * 180 / kPi;
  scene.cameras.push_back(camera);
  Film film;
  film.width = film.height = pixels;
  film.filter = FilterKind::kBox;
  film.filter_radius = 0.5f;
  scene.films.push_back(film);
  scene.samples_per_pixel = 1;
}

Image render_with(const World& world, const Cache& cache, RenderParams params) {
  Progress progress;
  Report report;
  Warnings warnings;
  params.single_samples = 0;
  Image image = render(world, cache, params, progress, report, warnings);
  EXPECT_TRUE(warnings.empty());
  return image;
}

Cache bake_exactly(const World& world) {
  Progress progress;
  Report report;
  BakeParams params;
  params.irradiance_samples = 64;
  return bake(world, plan_bake(*world.scene, params), params, progress, report);
}

// On a uniformly lit plane that is wide enough M_o is E_t times the profile's total.
TEST(Plane, MeanIsTheTotalOfTheProfile) {
  for (const ProfileKind profile :
       {ProfileKind::kDipole, ProfileKind::kBetterDipole, ProfileKind::kNormalized})
    for (const MonteCarloSampling sampling :
         {MonteCarloSampling::kUniform, MonteCarloSampling::kExponential}) {
      // The normalized profile has no bounded density to be sampled by area with.
      if (profile == ProfileKind::kNormalized && sampling == MonteCarloSampling::kUniform) continue;
      Scene scene;
      Medium medium = make_test_medium();
      medium.sigma_a = {1.0f, 2.0f, 0.5f};
      medium.profile = profile;
      add_shape(scene, placed(make_rectangle(), 6, {3, 1, 0}), kNone, add_medium(scene, medium));
      add_directional_light(scene, {0, 0, -1}, {1, 2, 3});
      const World world = make_world(scene, true);
      const MonteCarloDiffusion diffusion(world, 0, scene.media[0], sampling, 0);
      const SurfacePoint point = surface_point(world, world.tracer.intersect({{3.2f, 1.1f, 1}, {0, 0, -1}}));
      const auto profiles = make_profiles(medium);
      // Its own noise, from independent groups of samples.
      constexpr int kGroups = 32;
      const int per_group = sampling == MonteCarloSampling::kUniform ? 1 << 16 : 1 << 12;
      Vec3d sum(0, 0, 0), squares(0, 0, 0);
      for (std::uint64_t group = 0; group < kGroups; ++group) {
        const Vec3d value(diffusion.estimate(point, per_group, group, 0));
        sum += value;
        squares += value * value;
      }
      const double transmitted = 1 - fresnel_reflectance(1.0, static_cast<double>(medium.eta()));
      for (int k = 0; k < 3; ++k) {
        const double expected = profiles[static_cast<std::size_t>(k)].total * transmitted * (k + 1);
        const double mean = sum[k] / kGroups;
        const double error = std::sqrt((squares[k] / kGroups - square(mean)) / (kGroups - 1));
        EXPECT_LT(error, (sampling == MonteCarloSampling::kUniform ? 0.015 : 0.005) * expected)
            << static_cast<int>(profile) << " " << static_cast<int>(sampling);
        EXPECT_NEAR(mean / expected, 1, 0.001 + 3.5 * error / expected)
            << static_cast<int>(profile) << " " << static_cast<int>(sampling) << " " << k;
      }
    }
}

// A slab a few mean free paths thick, lit from behind and aslant by a lamp, and a bulky body with a shadow on
// it: blocks of both pictures differ by no more than the noise that the Monte Carlo's own pixels show.
struct Subject {
  const char* name;
  float window;  // that the camera sees
  void (*build)(Scene&);
};
const Subject kSubjects[] = {
    {"slab", 10,
     [](Scene& scene) {
       add_shape(scene, placed(make_cube(), Vec3(6, 6, 1.2f), {0, 0, 0}), kNone, 0);
       add_area_light(scene, placed(make_rectangle(), 2, {3, 1, -9}), {20, 25, 30});  // faces up
       add_point_light(scene, {-9, 4, 7}, {60, 50, 40});
     }},
    {"bumps", 5, [](Scene& scene) {
       Mesh mesh = make_sphere();
       for (Vec3& p : mesh.positions)
         p *= 2.5f * (1 + 0.15f * std::sin(5 * p.x) * std::sin(4 * p.y + 1) * std::sin(6 * p.z));
       mesh.normals.clear();
       add_shape(scene, std::move(mesh), kNone, 0);
       add_shape(scene, placed(make_sphere(), 0.5f, {1.5f, 1.5f, 3}));  // casts the shadow
       add_area_light(scene, flipped(placed(make_rectangle(), 1, {2.5f, 2.5f, 6})), {20, 25, 30});
       add_directional_light(scene, {1, 0.3f, 0.4f}, {2, 2, 2});
     }}};

TEST(Blocks, AgreeWithTheHierarchicalSumWithinTheirNoise) {
  constexpr int kPixels = 64, kBlock = 8;
  for (const Subject& subject : kSubjects) {
    Scene scene;
    add_medium(scene, make_test_medium());
    subject.build(scene);
    add_camera(scene, {0, 0, 60}, subject.window, kPixels);
    const World world = make_world(scene, true);
    const Cache cache = bake_exactly(world);
    RenderParams params = default_render_params(scene, 0);
    const Image fast = render_with(world, cache, params);
    for (const MonteCarloSampling sampling :
         {MonteCarloSampling::kUniform, MonteCarloSampling::kExponential}) {
      params.method = Method::kMonteCarlo;
      params.mc_sampling = sampling;
      params.mc_samples = 256;
      const Image slow = render_with(world, {}, params);
      int blocks = 0, outside = 0;
      double squares = 0, worst = 0, signed_sum = 0, noise = 0;
      for (const char* name : {"diffusion.R", "diffusion.G", "diffusion.B"}) {
        const std::vector<float>& a = find_channel(fast, name)->values;
        const std::vector<float>& b = find_channel(slow, name)->values;
        for (int by = 0; by < kPixels; by += kBlock)
          for (int bx = 0; bx < kPixels; bx += kBlock) {
            double sum = 0, sum2 = 0, light = 0;
            for (int i = 0; i < kBlock * kBlock; ++i) {
              const auto at = static_cast<std::size_t>((by + i / kBlock) * kPixels + bx + i % kBlock);
              const double difference = static_cast<double>(b[at]) - static_cast<double>(a[at]);
              sum += difference;
              sum2 += square(difference);
              light += static_cast<double>(a[at]);
            }
            if (light == 0) continue;
            constexpr double kCount = kBlock * kBlock;
            const double sigma = std::sqrt((sum2 - sum * sum / kCount) / (kCount - 1) / kCount);
            const double deviation = std::abs(sum / kCount) / sigma;
            ++blocks;
            outside += deviation > 3;
            squares += square(deviation);
            signed_sum += sum / kCount / sigma;
            noise += sigma * kCount / light;
            worst = std::max(worst, deviation);
          }
      }
      fmt::print(
          "{}, {}: {} blocks, {} beyond 3 sigma, worst {:.2f}, mean square {:.2f}, mean {:.2f}, noise {:.2f} "
          "%\n",
          subject.name, sampling == MonteCarloSampling::kUniform ? "uniform" : "exponential", blocks, outside,
          worst, squares / blocks, signed_sum / blocks, 100 * noise / blocks);
      EXPECT_GE(blocks, 120) << subject.name;
      EXPECT_LE(outside, std::max(2, blocks / 100)) << subject.name;
      EXPECT_LT(worst, 4.5) << subject.name;
      // The three channels of a block share their samples: a third of the deviations are independent.
      EXPECT_LT(squares / blocks, 1.03 + 4 * std::sqrt(2.0 / (blocks / 3))) << subject.name;
    }
  }
}

TEST(Lambert, IsTheTotalWhereTheLightComesIn) {
  Scene scene;
  Medium medium = make_test_medium();
  medium.lambert = true;
  add_shape(scene, placed(make_rectangle(), 10, {0, 0, 0}), kNone, add_medium(scene, medium));
  const Vec3 in = Vec3(0.5f, 0.2f, 0.8f).normalized();
  add_directional_light(scene, -in, {1, 2, 3});
  add_camera(scene, {0, 0, 1000}, 1, 2);
  World world = make_world(scene, true);
  const auto profiles = make_profiles(medium);
  const double eta = static_cast<double>(medium.eta());
  for (const Convention convention : {Convention::kPublished, Convention::kConserving}) {
    scene.media[0].convention = convention;
    refresh(world);
    // By the medium's own wish, which needs no cache either.
    const Image image = render_with(world, {}, default_render_params(scene, 0));
    const double through = (1 - fresnel_reflectance(static_cast<double>(in.z), eta)) *
                           (1 - fresnel_reflectance(1.0, eta)) /
                           (convention == Convention::kConserving ? mean_transmittance(eta) : 1);
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(
          static_cast<double>(image.channels[static_cast<std::size_t>(k)].values[0]),
          profiles[static_cast<std::size_t>(k)].total * static_cast<double>(in.z) * (k + 1) * through / kPiD,
          1e-4);
  }
}

}  // namespace
}  // namespace nacre
