// label: analytic
// Light from all around: orientation, densities, and estimates against closed forms.
#include <gtest/gtest.h>

#include "base/statistics.h"
#include "nacre/transport/light.h"
#include "transport/scene_parts.h"

namespace nacre {
namespace {

using namespace testing_support;

EnvironmentMap black_map(int width, int height) {
  EnvironmentMap map;
  map.radiance = {width, height, std::vector<Rgb>(static_cast<std::size_t>(width * height), Rgb(0, 0, 0))};
  return map;
}
Rgb& texel(EnvironmentMap& map, int x, int y) {
  return map.radiance.texels[static_cast<std::size_t>(y * map.radiance.width + x)];
}
// Of very different brightness, with black parts, at the poles and the seam too.
EnvironmentMap rough_map(int width, int height) {
  EnvironmentMap map = black_map(width, height);
  Rng rng(3);
  for (Rgb& t : map.radiance.texels)
    if (rng.next_float() < 0.3f) t = Rgb(1, 2, 3) * std::exp(5 * rng.next_float());
  return map;
}
Scene scene_with(const EnvironmentMap& map) {
  Scene scene;
  scene.lights.push_back({"", "", map});
  return scene;
}
Matrix4 some_rotation() {
  Matrix4 m;
  m.rotate(Imath::V3d(0.3, 1.1, -0.7));
  return m;
}

TEST(Environment, HasMitsubasOrientation) {
  // Looked at from inside: +y above, the middle is +z, +x a quarter from the left.
  struct Case {
    int x, y;
    Vec3 direction;
  };
  for (const Case& c : {Case{16, 8, {0, 0, 1}}, {8, 8, {1, 0, 0}}, {24, 8, {-1, 0, 0}}, {0, 8, {0, 0, -1}}}) {
    EnvironmentMap map = black_map(32, 16);
    for (int dx = -1; dx <= 0; ++dx)
      for (int dy = -1; dy <= 0; ++dy) texel(map, (c.x + dx + 32) % 32, c.y + dy) = Rgb(1, 2, 3);
    const Environment environment(map);
    EXPECT_NEAR(environment.radiance(c.direction).z, 3, 1e-4) << c.direction;
    EXPECT_TRUE(is_black(environment.radiance(-c.direction)));
    map.to_world = some_rotation();
    Vec3 turned;
    map.to_world.multDirMatrix(c.direction, turned);
    EXPECT_NEAR(Environment(map).radiance(turned).z, 3, 1e-4) << c.direction;
  }
  EnvironmentMap map = black_map(8, 4);
  for (int x = 0; x < 8; ++x) texel(map, x, 0) = Rgb(1, 1, 1);
  EXPECT_EQ(Environment(map).radiance({0, 1, 0}), Rgb(1, 1, 1));
  EXPECT_EQ(Environment(map).radiance({0, -1, 0}), Rgb(0, 0, 0));
}

// Solid-angle grid over the sphere.
template <class Function>
double integrate_sphere(const Function& function, int rows = 600) {
  double sum = 0;
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < 2 * rows; ++j) {
      const double z = 1 - (2.0 * i + 1) / rows, phi = kPiD * (j + 0.5) / rows, r = std::sqrt(1 - z * z);
      sum += function(Vec3(static_cast<float>(r * std::cos(phi)), static_cast<float>(r * std::sin(phi)),
                           static_cast<float>(z)));
    }
  return sum * 4 * kPiD / (2.0 * rows * rows);
}

TEST(Environment, DensityIntegratesToOneAndCoversTheLight) {
  for (EnvironmentMap map : {rough_map(24, 12), rough_map(1, 1), rough_map(3, 2)}) {
    texel(map, 0, 0) = Rgb(5, 5, 5);
    map.to_world = some_rotation();
    const Environment environment(map);
    EXPECT_NEAR(integrate_sphere([&](const Vec3& d) { return static_cast<double>(environment.pdf(d)); }), 1,
                3e-3);
    EXPECT_NEAR(integrate_sphere([&](const Vec3& d) {
                  return static_cast<double>(mean_channel(environment.radiance(d)));
                }) / environment.total(),
                1, map.radiance.width > 3 ? 0.02 : 0.5);
    Rng rng(1);
    for (int i = 0; i < 20000; ++i) {
      const Vec3 d = sample_uniform_sphere(rng.next_2d());
      if (max_channel(environment.radiance(d)) > 1e-4f) {
        EXPECT_GT(environment.pdf(d), 0) << d;
      }
    }
  }
}

// Bins of equal solid angle.
std::size_t bin_of(const Vec3& d) {
  const float phi = std::atan2(d.y, d.x) / (2 * kPi);
  const auto column = static_cast<std::size_t>(std::clamp((phi < 0 ? phi + 1 : phi) * 32, 0.0f, 31.0f));
  return 32 * static_cast<std::size_t>(std::clamp((1 - d.z) * 8, 0.0f, 15.0f)) + column;
}
template <class Sample, class Pdf>
double sampling_p(const Sample& sample, const Pdf& pdf) {
  constexpr int kSamples = 100000;
  std::vector<double> counts(512), expected(512);
  Rng rng(4);
  int differ = 0;
  double total = 0, missed = 0;
  for (int i = 0; i < kSamples; ++i) {
    const LightSample s = sample(rng.next_2d());
    if (s.pdf > 0) {
      ++counts[bin_of(s.direction)];
      differ += std::abs(pdf(s.direction) / s.pdf - 1) > 1e-2f;
    } else {
      ++missed;
    }
  }
  EXPECT_LT(differ, kSamples / 1000);  // rounding across the edge of a texel or triangle
  integrate_sphere(
      [&](const Vec3& d) {
        expected[bin_of(d)] += static_cast<double>(pdf(d));
        return total += static_cast<double>(pdf(d));
      },
      1600);
  for (double& e : expected) e *= (kSamples - missed) / total;
  return chi_square_p(counts, expected);
}

TEST(Environment, SamplesFollowTheirDensity) {
  EnvironmentMap map = rough_map(16, 8);
  map.to_world = some_rotation();
  const Scene scene = scene_with(map);
  const World world = make_world(scene, true);
  EXPECT_GT(sampling_p([&](const Vec2& u) { return sample_light(world, 0, Vec3(0), u); },
                       [&](const Vec3& d) { return pdf_light(world, 0, Vec3(0), d); }),
            1e-4);
}

TEST(Environment, ConstantLightFollowsItsDensity) {
  Scene scene;
  add_constant_light(scene, Rgb(2, 2, 2));
  const World world = make_world(scene, true);
  for (const Vec3& normal : {kNoNormal, Vec3(0.6f, 0, -0.8f)})
    EXPECT_GT(sampling_p([&](const Vec2& u) { return sample_light(world, 0, Vec3(0), u, normal); },
                         [&](const Vec3& d) { return pdf_light(world, 0, Vec3(0), d, normal); }),
              1e-4);
}

// The density of a hit on an area light is that of the sample that meets it: a sphere and a bent sheet with a
// hole and a degenerate triangle.
TEST(AreaLight, SamplesFollowTheDensityOfHits) {
  Mesh sheet;
  sheet.positions = {{-1, -1, 2}, {1, -1, 2}, {1, 1, 1}, {-1, 1, 1}, {0, 3, 0.5f}};
  sheet.triangles = {{0, 2, 1}, {0, 0, 2}, {3, 4, 2}};
  for (const Mesh& mesh : {sheet, placed(make_sphere(), 0.8f, {1, 0, 1})}) {
    Scene scene;
    add_area_light(scene, mesh, Rgb(1, 1, 1));
    const World world = make_world(scene, true);
    const Vec3 x(0.1f, 0.2f, 0);
    EXPECT_GT(sampling_p([&](const Vec2& u) { return sample_light(world, 0, x, u); },
                         [&](const Vec3& d) {
                           return pdf_light(world, 0, x, world.tracer.intersect({x, d}));
                         }),
              1e-4);
  }
}

TEST(Environment, LightsWithoutDensity) {
  Scene scene = scene_with(rough_map(4, 4));
  add_point_light(scene, {0, 0, 1}, Rgb(1, 1, 1));
  add_area_light(scene, placed(make_rectangle(), 1, {0, 0, -1}), Rgb(1, 1, 1));
  const World world = make_world(scene, true);
  const Hit hit = world.tracer.intersect({{0, 0.1f, 0}, {0, 0, -1}});
  ASSERT_TRUE(hit);
  EXPECT_GT(pdf_light(world, 2, {0, 0.1f, 0}, hit), 0);
  EXPECT_EQ(pdf_light(world, 2, {0, 0.1f, -2}, hit), 0);  // from behind
  EXPECT_EQ(pdf_light(world, 2, Vec3(0), Hit{}), 0);
  EXPECT_EQ(pdf_light(world, 1, Vec3(0), hit), 0);
  EXPECT_EQ(pdf_light(world, 2, Vec3(0), Vec3(0, 0, -1)), 0);
  EXPECT_EQ(pdf_light(world, 1, Vec3(0), Vec3(0, 0, 1)), 0);
}

TEST(Environment, RadianceFromAllAround) {
  Scene scene;
  add_shape(scene, make_rectangle());
  EXPECT_TRUE(is_black(environment_radiance(make_world(scene, true), {0, 0, 1})));
  add_constant_light(scene, Rgb(1, 2, 3));
  EXPECT_EQ(environment_radiance(make_world(scene, true), {0, 0, 1}), Rgb(1, 2, 3));
  const Scene mapped = scene_with(black_map(4, 2));
  const World black = make_world(mapped, true);
  EXPECT_TRUE(is_black(environment_radiance(black, {0, 0, 1})));
  EXPECT_TRUE(is_black(sample_light(black, 0, Vec3(0), {0.5f, 0.5f}).irradiance));
  EXPECT_EQ(pdf_light(black, 0, Vec3(0), Vec3(0, 0, 1)), 0);
}

double mean_irradiance(const World& world, const Vec3& normal, int samples, std::uint64_t key) {
  double sum = 0;
  for_each_connection(world, Vec3(0), normal, samples, key, 0, [&](const Connection& c) {
    sum += static_cast<double>(c.sample.irradiance.x * std::max(0.0f, dot(c.sample.direction, normal)));
  });
  return sum;
}

// One bright texel is a sun: its tent covers four texels, weighs one.
TEST(Environment, OneBrightTexelIsADirectionalLight) {
  EnvironmentMap map = black_map(720, 360);
  texel(map, 180, 89) = Rgb(100, 100, 100);
  map.to_world = some_rotation();
  const Scene scene = scene_with(map);
  const World world = make_world(scene, true);
  const double theta = kPiD * 89.5 / 360, phi = kPiD * 2 * 180.5 / 720;
  const Vec3d local(std::sin(theta) * std::sin(phi), std::cos(theta), -std::sin(theta) * std::cos(phi));
  Vec3d sun;
  map.to_world.multDirMatrix(local, sun);
  const double power = 100 * square(kPiD / 360) * std::sin(theta);
  for (const Vec3& normal : {Vec3(0, 0, 1), Vec3(0.6f, -0.8f, 0), Vec3(-0.36f, 0.48f, 0.8f)})
    EXPECT_NEAR(mean_irradiance(world, normal, 4096, 1), power * std::max(0.0, sun.dot(Vec3d(normal))),
                2e-3 * power);
}

TEST(Environment, IrradianceOfAConstantLightHasNoNoise) {
  Scene scene;
  add_constant_light(scene, Rgb(0.7f, 1, 1));
  const World world = make_world(scene, true);
  for (const int samples : {1, 7})
    EXPECT_NEAR(mean_irradiance(world, {0, 0.6f, 0.8f}, samples, 3), 0.7 * kPiD, 1e-5);
}

// Means of 1024 estimates against the exact value, with 16 and with 256 samples each: the variance falls at
// least as the number of samples rises.
TEST(Environment, VarianceFallsAtLeastWithTheNumberOfSamples) {
  Scene area;
  add_area_light(area, placed(flipped(make_rectangle()), {1, 2, 1}, {0.5f, 0, 1}), Rgb(1, 1, 1));
  for (const Scene& scene : {scene_with(rough_map(32, 16)), area}) {
    const World world = make_world(scene, true);
    const auto variance = [&](int samples) {
      double sum = 0, squares = 0;
      for (std::uint64_t key = 0; key < 1024; ++key) {
        const double value = mean_irradiance(world, {0, 0, 1}, samples, hash_words(key, 5));
        sum += value;
        squares += value * value;
      }
      return (squares - sum * sum / 1024) / 1023;
    };
    const double few = variance(16), many = variance(256);
    EXPECT_GT(few, 0);
    EXPECT_LT(many, few / 16 * 1.2);  // 1.2: of 1024 estimates
  }
}

}  // namespace
}  // namespace nacre
