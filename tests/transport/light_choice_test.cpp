// label: analytic
// Choosing among many lights is without bias, by the probabilities that are stated, and worth it.
#include <gtest/gtest.h>

#include "base/statistics.h"
#include "nacre/transport/light.h"
#include "transport/scene_parts.h"

namespace nacre {
namespace {

using namespace testing_support;

// Lights of every kind around the origin, of very different powers.
Scene many_lights(int count) {
  Scene scene;
  Rng rng(5);
  for (int i = 0; i < count; ++i) {
    const Vec3 p = sample_uniform_sphere(rng.next_2d()) * (1 + 5 * rng.next_float());
    const Rgb power = Rgb(1, 0.5f, 0.25f) * std::exp(4 * rng.next_float());
    const Vec3 direction = sample_uniform_sphere(rng.next_2d());
    if (i % 4 == 0) {
      add_point_light(scene, p, power);
    } else if (i % 4 == 1) {
      Mesh mesh = placed(make_rectangle(), 0.2f, Vec3(0));
      const Frame frame = make_frame(direction);
      for (Vec3& v : mesh.positions) v = frame.to_world(v) + p;
      for (Vec3& n : mesh.normals) n = direction;
      add_area_light(scene, mesh, power * 6.0f);
    } else if (i % 4 == 2) {
      SpotLight spot{p, direction, power};
      spot.cutoff_angle = 60;
      spot.beam_width = 30;
      scene.lights.push_back({"", "", spot});
    } else if (i == 3 || i == 7) {
      add_directional_light(scene, direction, power * 0.05f);
    } else if (i == 11) {
      add_constant_light(scene, Rgb(0.3f, 0.3f, 0.3f));
    } else {
      add_area_light(scene, placed(make_sphere(), 0.1f, p), power * 10.0f);
    }
  }
  return scene;
}

float cosine_at(const Vec3& normal, const Vec3& direction) {
  return normal == kNoNormal ? 1 : std::max(0.0f, dot(normal, direction));
}

// What all lights send, one after the other.
double sum_of_lights(const World& world, const Vec3& x, const Vec3& normal) {
  constexpr std::uint32_t kSamples = 1 << 12;
  double sum = 0;
  for (std::size_t light = 0; light < world.scene->lights.size(); ++light)
    for (std::uint32_t s = 0; s < kSamples; ++s) {
      const LightSample sample = sample_light(world, light, x, sobol_2d(s, light), normal);
      sum += static_cast<double>(sample.irradiance.x * cosine_at(normal, sample.direction)) / kSamples;
    }
  return sum;
}

struct Estimate {
  double mean = 0, variance = 0;  // of one estimate
};
Estimate estimate(const World& world, const Vec3& x, const Vec3& normal, int samples, int repeats) {
  double sum = 0, squares = 0;
  for (int r = 0; r < repeats; ++r) {
    double value = 0;
    for_each_connection(
        world, x, normal, samples, hash_words(static_cast<std::uint64_t>(r), 77), 0,
        [&](const Connection& c) {
          value += static_cast<double>(c.sample.irradiance.x * cosine_at(normal, c.sample.direction));
        });
    sum += value;
    squares += value * value;
  }
  const double mean = sum / repeats;
  return {mean, std::max(0.0, squares / repeats - mean * mean)};
}

const Vec3 kPoints[] = {{0, 0, 0}, {1, -2, 0.5f}, {30, 4, -5}};
const Vec3 kNormals[] = {kNoNormal, {0, 0, 1}, {0.6f, -0.8f, 0}};

TEST(LightChoice, IsWithoutBias) {
  for (const int count : {9, 100}) {
    const Scene scene = many_lights(count);
    const World world = make_world(scene, false);
    for (const Vec3& x : kPoints)
      for (const Vec3& normal : kNormals) {
        const double expected = sum_of_lights(world, x, normal);
        const Estimate chosen = estimate(world, x, normal, 4, 4000);
        // Of five standard errors, and what the sum itself may be wrong by.
        EXPECT_NEAR(chosen.mean, expected, 5 * std::sqrt(chosen.variance / 4000) + 2e-3 * expected)
            << count << " lights, " << x << " " << normal;
      }
  }
}

TEST(LightChoice, ProbabilitiesAreThoseOfTheChoices) {
  const Scene scene = many_lights(60);
  const World world = make_world(scene, false);
  constexpr int kChoices = 200000;
  for (const Vec3& x : kPoints)
    for (const Vec3& normal : kNormals) {
      std::vector<double> counts(scene.lights.size() + 1), expected(scene.lights.size() + 1);
      Rng rng(9);
      for (int i = 0; i < kChoices; ++i) {
        const LightChoice choice = choose_light(world, x, rng.next_double(), normal);
        if (!(choice.probability > 0)) {
          ++counts.back();
          continue;
        }
        ++counts[choice.light];
        EXPECT_NEAR(choice.probability / probability_of_light(world, x, choice.light, normal), 1, 1e-9);
      }
      double total = 0;
      for (std::size_t light = 0; light < scene.lights.size(); ++light) {
        total += expected[light] = probability_of_light(world, x, light, normal);
        expected[light] *= kChoices;
      }
      EXPECT_LE(total, 1 + 1e-9);
      expected.back() = std::max(0.0, 1 - total) * kChoices;
      if (expected.back() < 1e-6) expected.back() = 0;
      EXPECT_GT(chi_square_p(counts, expected), 1e-4) << x << " " << normal;
    }
}

// Whatever a light can reach may be chosen.
TEST(LightChoice, LeavesOutOnlyWhatCannotBeSeen) {
  const Scene scene = many_lights(200);
  const World world = make_world(scene, false);
  Rng rng(2);
  for (int i = 0; i < 100; ++i) {
    const Vec3 x = sample_uniform_sphere(rng.next_2d()) * (7 * rng.next_float());
    const Vec3 normal = sample_uniform_sphere(rng.next_2d());
    for (std::size_t light = 0; light < scene.lights.size(); ++light) {
      const LightSample sample = sample_light(world, light, x, rng.next_2d(), normal);
      if (is_black(sample.irradiance)) continue;
      EXPECT_GT(probability_of_light(world, x, light), 0);
      if (dot(sample.direction, normal) > 0) {
        EXPECT_GT(probability_of_light(world, x, light, normal), 0);
      }
    }
  }
}

TEST(LightChoice, FollowsPowerAndDistance) {
  Scene scene;
  for (int i = 0; i < 1000; ++i) add_point_light(scene, {static_cast<float>(i), 0, 1}, Rgb(1, 1, 1));
  std::get<PointLight>(scene.lights[990].model).intensity = Rgb(5, 5, 5);
  const World world = make_world(scene, false);
  // The nearest of all gives 61 % of the light, its neighbours the next.
  EXPECT_GT(probability_of_light(world, {0, 0, 0}, 0), 0.2);
  EXPECT_GT(probability_of_light(world, {0, 0, 0}, 0), 100 * probability_of_light(world, {0, 0, 0}, 500));
  EXPECT_GT(probability_of_light(world, {990, 0, 0}, 990), 2 * probability_of_light(world, {990, 0, 0}, 991));
  const Estimate near = estimate(world, {0, 0, 0}, kNoNormal, 1, 4000);
  EXPECT_LT(std::sqrt(near.variance) / near.mean, 0.5);  // by eight connections to a thousand lights
}

TEST(LightChoice, HonoursSamplingWeights) {
  Scene scene = many_lights(0);
  for (int i = 0; i < 10; ++i) add_directional_light(scene, {0, 0, -1}, Rgb(1, 1, 1));
  EXPECT_NEAR(probability_of_light(make_world(scene, false), Vec3(0), 3), 0.1, 1e-12);
  scene.lights[3].sampling_weight = 6;
  const World world = make_world(scene, false);
  EXPECT_NEAR(probability_of_light(world, Vec3(0), 3), 6 / 15.0, 1e-12);
  EXPECT_NEAR(estimate(world, Vec3(0), kNoNormal, 2, 4000).mean, 10, 0.1);
  for (Light& light : scene.lights) light.model = PointLight{{0, 0, 1}, {1, 1, 1}};
  EXPECT_NEAR(probability_of_light(make_world(scene, false), Vec3(0), 3), 6 / 15.0, 0.2);
}

TEST(LightChoice, CountsConnectionsOfFewLights) {
  Scene scene = many_lights(2);  // a point and a rectangle
  add_constant_light(scene, Rgb(1, 1, 1));
  const World world = make_world(scene, false);
  std::vector<int> counts(3);
  for_each_connection(world, {0, 0, 20}, kNoNormal, 16, 1, 0, [&](const Connection& c) {
    ++counts[c.light];
    EXPECT_FLOAT_EQ(c.density, c.light == 0 ? 0 : 16 * c.sample.pdf);
  });
  EXPECT_EQ(counts[0], 1);
  EXPECT_EQ(counts[2], 16);
  EXPECT_EQ(expected_connections(world, 0, Vec3(0), kNoNormal, 16), 1);
  EXPECT_EQ(expected_connections(world, 1, Vec3(0), kNoNormal, 16), 16);
}

// Connections and hits of rays by cosine, weighted by the balance heuristic with the densities that are
// stated, sum to the irradiance, and are no worse than either alone.
TEST(LightChoice, DensitiesServeMultipleImportanceSampling) {
  const Vec3 x(0.3f, 0.2f, 0), normal(0, 0, 1);
  for (const int lights : {3, 20}) {
    Scene scene;
    for (int i = 0; i < lights; ++i) {
      const float angle = 2.4f * static_cast<float>(i), size = 0.1f + 0.1f * static_cast<float>(i % 5);
      const Vec3 at(2 * std::cos(angle), 2 * std::sin(angle), 1 + 0.3f * static_cast<float>(i % 4));
      add_area_light(scene, placed(flipped(make_rectangle()), size, at), Rgb(1, 1, 1) / size);
    }
    add_constant_light(scene, Rgb(0.2f, 0.2f, 0.2f));
    const World world = make_world(scene, true);
    constexpr int kRepeats = 20000;
    double sum[3] = {}, squares[3] = {};  // connections, rays, both
    for (std::uint64_t r = 0; r < kRepeats; ++r) {
      double value[3] = {};
      for_each_connection(world, x, normal, 1, hash_words(r, 1), 0, [&](const Connection& c) {
        const float cosine = dot(c.sample.direction, normal);
        if (cosine <= 0 || is_black(see_light(world, x, c.sample).transmittance)) return;
        const auto part = static_cast<double>(c.sample.irradiance.x * cosine);
        const auto by_rays = static_cast<double>(pdf_cosine_hemisphere(cosine));
        value[0] += part;
        value[2] += part * static_cast<double>(c.density) / (static_cast<double>(c.density) + by_rays);
      });
      const Vec3 direction = sample_cosine_hemisphere(sobol_2d(0, hash_words(r, 2)));
      const Hit hit = world.tracer.intersect({x, direction});
      const std::size_t light =
          hit ? static_cast<std::size_t>(world.shape(hit).light) : world.lights->environment;
      const float radiance = !hit              ? environment_radiance(world, direction).x
                             : direction.z > 0 ? std::get<AreaLight>(scene.lights[light].model).radiance.x
                                               : 0;
      const float pdf = hit ? pdf_light(world, light, x, hit) : pdf_light(world, light, x, direction, normal);
      const auto density = static_cast<double>(expected_connections(world, light, x, normal, 1) * pdf);
      const auto by_rays = static_cast<double>(pdf_cosine_hemisphere(direction.z));
      value[1] = static_cast<double>(radiance * kPi);
      value[2] += value[1] * by_rays / (by_rays + density);
      for (int k = 0; k < 3; ++k) {
        sum[k] += value[k] / kRepeats;
        squares[k] += value[k] * value[k] / kRepeats;
      }
    }
    double variance[3];
    for (int k = 0; k < 3; ++k) variance[k] = squares[k] - sum[k] * sum[k];
    EXPECT_NEAR(sum[2], sum[0], 5 * std::sqrt((variance[0] + variance[2]) / kRepeats)) << lights;
    EXPECT_NEAR(sum[2], sum[1], 5 * std::sqrt((variance[1] + variance[2]) / kRepeats)) << lights;
    EXPECT_LT(variance[2], 2 * std::min(variance[0], variance[1])) << lights;
  }
}

// Lights that shine away, are black or lie where the light arrives do no harm.
TEST(LightChoice, NothingToChoose) {
  Scene scene;
  for (int i = 0; i < 5; ++i) add_area_light(scene, placed(make_rectangle(), 1, {0, 0, 1}), Rgb(1, 1, 1));
  for (int i = 0; i < 5; ++i) add_point_light(scene, {0, 0, -1}, Rgb(0, 0, 0));
  const World world = make_world(scene, false);
  EXPECT_EQ(choose_light(world, {0, 0, -3}, 0.5).probability, 0);
  EXPECT_EQ(probability_of_light(world, {0, 0, -3}, 2), 0);
  EXPECT_EQ(estimate(world, Vec3(0), kNoNormal, 1, 100).mean, 0);
  for (Light& light : scene.lights) light.model = PointLight{{0, 0, 0}, {1, 1, 1}};
  const Estimate inside = estimate(make_world(scene, false), Vec3(0), kNoNormal, 1, 100);
  EXPECT_EQ(inside.mean, 0);
  EXPECT_GT(estimate(make_world(scene, false), Vec3(0, 0, 1), kNoNormal, 1, 100).mean, 9.99);
}

}  // namespace
}  // namespace nacre
