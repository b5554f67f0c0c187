// label: analytic
// Connections to lights integrate to what is known, and bounced light to closed forms.
#include <gtest/gtest.h>

#include "nacre/base/error.h"
#include "nacre/base/random.h"
#include "nacre/transport/path.h"
#include "transport/scene_parts.h"

namespace nacre {
namespace {

using namespace testing_support;

// Mean of the samples' irradiance times `weight`, a function of their direction.
template <class Weight>
double integrate(const World& world, const Vec3& x, const Weight& weight) {
  constexpr std::uint32_t kSamples = 1 << 16;
  double sum = 0;
  for (std::uint32_t s = 0; s < kSamples; ++s) {
    const LightSample sample = sample_light(world, 0, x, sobol_2d(s, 3));
    if (!is_black(sample.irradiance))
      sum += static_cast<double>(sample.irradiance.x * weight(sample.direction));
  }
  return sum / kSamples;
}
double solid_angle(const World& world, const Vec3& x) {
  return integrate(world, x, [](const Vec3&) { return 1.0f; });
}

// Source: Van Oosterom & Strackee 1983, for the solid angle of a triangle.
double triangle_solid_angle(Vec3d a, Vec3d b, Vec3d c) {
  const double product = a.dot(b.cross(c));
  const double la = a.length(), lb = b.length(), lc = c.length();
  return 2 * std::atan2(std::abs(product), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

TEST(Light, RectangleFillsItsSolidAngle) {
  Scene scene;
  add_area_light(scene, placed(make_rectangle(), {1.5f, 0.4f, 1}, {0.5f, 0.2f, -1}), Rgb(1, 1, 1));
  const World world = make_world(scene, true);
  for (const Vec3& x : {Vec3(0, 0, 0), Vec3(1, 2, 0.5f), Vec3(-3, 0, -0.7f)}) {
    const Mesh& mesh = scene.shapes[0].mesh;
    double expected = 0;
    for (const Triangle& t : mesh.triangles)
      expected += triangle_solid_angle(Vec3d(mesh.positions[t[0]] - x), Vec3d(mesh.positions[t[1]] - x),
                                       Vec3d(mesh.positions[t[2]] - x));
    EXPECT_NEAR(solid_angle(world, x) / expected, 1, 2e-3);
  }
  EXPECT_EQ(solid_angle(world, {0, 0, -2}), 0);  // behind it
  EXPECT_EQ(solid_angle(world, {0, 0, -1}), 0);  // in its plane
}

// Triangles of very different sizes are chosen by area.
TEST(Light, SphereFillsItsSolidAngle) {
  Scene scene;
  add_area_light(scene, placed(make_sphere(), 0.7f, {0, 0, 2}), Rgb(1, 1, 1));
  const World world = make_world(scene, true);
  const double edge = std::sqrt(1 - square(0.35));
  EXPECT_NEAR(solid_angle(world, Vec3(0)) / (2 * kPiD * (1 - edge)), 1, 3e-3);
  // Irradiance on a receiver that faces it: pi sin^2 of the half angle.
  EXPECT_NEAR(integrate(world, Vec3(0), [](const Vec3& d) { return d.z; }) / (kPiD * square(0.35)), 1, 3e-3);
}
TEST(Light, CubeFromInsideFillsTheSphere) {
  Scene scene;
  add_area_light(scene, placed(flipped(make_cube()), {1, 3, 0.2f}, Vec3(0)), Rgb(1, 1, 1));
  EXPECT_NEAR(solid_angle(make_world(scene, true), {0.2f, 0.5f, 0}) / (4 * kPiD), 1, 0.02);
}

TEST(Light, SamplesLieOnTheLight) {
  Scene scene;
  add_area_light(scene, placed(make_rectangle(), 0.5f, {0, 0, -1}), Rgb(1, 1, 1));
  const World world = make_world(scene, true);
  const Vec3 x(0.3f, 1, 1);
  for (std::uint32_t s = 0; s < 100; ++s) {
    const LightSample sample = sample_light(world, 0, x, sobol_2d(s, 1));
    EXPECT_NEAR(sample.direction.length(), 1, 1e-5);
    const Vec3 p = x + sample.direction * sample.distance;
    EXPECT_NEAR(p.z, -1, 1e-5);
    EXPECT_LE(std::max(std::abs(p.x), std::abs(p.y)), 0.5f + 1e-5f);
    EXPECT_EQ(see_light(world, x, sample).transmittance, Rgb(1, 1, 1));  // its own surface is no obstacle
  }
}

TEST(Light, PointAndDirectional) {
  Scene scene;
  add_point_light(scene, {0, 0, 4}, Rgb(32, 16, 8));
  add_directional_light(scene, {0, 3, -4}, Rgb(1, 2, 3));
  const World world = make_world(scene, true);
  const LightSample point = sample_light(world, 0, Vec3(0), {});
  EXPECT_EQ(point.direction, Vec3(0, 0, 1));
  EXPECT_FLOAT_EQ(point.distance, 4);
  EXPECT_EQ(point.irradiance, Rgb(2, 1, 0.5f));
  const LightSample directional = sample_light(world, 1, {5, 6, 7}, {});
  EXPECT_NEAR((directional.direction - Vec3(0, -0.6f, 0.8f)).length(), 0, 1e-6);
  EXPECT_TRUE(std::isinf(directional.distance));
  EXPECT_EQ(directional.irradiance, Rgb(1, 2, 3));
}

TEST(Light, Visibility) {
  Scene scene;
  add_point_light(scene, {0, 0, 2}, Rgb(1, 1, 1));
  add_directional_light(scene, {0, 0, -1}, Rgb(1, 1, 1));
  add_shape(scene, placed(make_rectangle(), 1, {0, 0, 1}));
  const World world = make_world(scene, true), open = make_world(scene, false);
  for (const std::size_t light : {0u, 1u}) {
    EXPECT_TRUE(is_black(see_light(world, Vec3(0), sample_light(world, light, Vec3(0), {})).transmittance));
    EXPECT_FALSE(is_black(see_light(open, Vec3(0), sample_light(open, light, Vec3(0), {})).transmittance));
    const Vec3 above(0, 0, 1.5f);
    EXPECT_FALSE(is_black(see_light(world, above, sample_light(world, light, above, {})).transmittance));
  }
}

TEST(Light, NeedsArea) {
  Scene scene;
  Mesh mesh = make_rectangle();
  mesh.positions.assign(mesh.positions.size(), Vec3(1, 2, 3));
  add_area_light(scene, mesh, Rgb(1, 1, 1));
  scene.lights[0].place = "scene.xml:7";
  try {
    make_world(scene, true);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kValue);
    EXPECT_EQ(error.place(), "scene.xml:7");
  }
}

TEST(Light, DirectlyReflectedFromAFloor) {
  Scene scene;
  const Rgb albedo(0.6f, 0.3f, 0.9f);
  add_shape(scene, placed(make_rectangle(), 10, Vec3(0)), add_diffuse(scene, albedo));
  add_directional_light(scene, Vec3(0, 0.6f, -0.8f), Rgb(2, 2, 2));
  const World world = make_world(scene, true);
  const Ray down{{0.1f, 0.2f, 3}, {0, 0, -1}};
  const auto reflect = [&](const Vec3& out) {
    return reflect_direct_light(world, scatter_point(world, world.tracer.intersect(down), out), 4, 1, 0,
                                Continuation::kEnds);
  };
  for (const float z : {0.1f, 1.0f}) {
    const Vec3 out = Vec3(0.3f, 0, z).normalized();
    const Rgb radiance = reflect(out);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(radiance[k], albedo[k] * 2 * 0.8f / kPi, 1e-5);
  }
  EXPECT_TRUE(is_black(reflect({0, 0, -1})));
}

// Under an even sky the albedo is what comes back, and nothing of it is noise.
TEST(Light, ReflectedSky) {
  Scene scene;
  const Rgb albedo(0.6f, 0.3f, 0.9f);
  add_shape(scene, placed(make_rectangle(), 10, Vec3(0)), add_diffuse(scene, albedo));
  add_constant_light(scene, Rgb(2, 2, 2));
  const World world = make_world(scene, true);
  const ScatterPoint at =
      scatter_point(world, world.tracer.intersect({{0.1f, 0.2f, 3}, {0, 0, -1}}), {0, 0.6f, 0.8f});
  const Rgb radiance = reflect_direct_light(world, at, 1, 1, 0, Continuation::kEnds);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(radiance[k], albedo[k] * 2, 1e-5);
}

TEST(Light, SpotFadesBetweenItsAngles) {
  Scene scene;
  SpotLight spot{{0, 0, 4}, {0, 0, -1}, Rgb(32, 16, 8)};
  scene.lights.push_back({"", "", spot});
  const World world = make_world(scene, true);
  EXPECT_EQ(sample_light(world, 0, Vec3(0), {}).irradiance, Rgb(2, 1, 0.5f));
  EXPECT_EQ(sample_light(world, 0, Vec3(0), {}).pdf, 0);
  const auto at = [&](double degrees) {
    const double angle = degrees * kPiD / 180;
    return sample_light(world, 0,
                        {static_cast<float>(std::sin(angle)), 0, static_cast<float>(4 - std::cos(angle))}, {})
        .irradiance.x;
  };
  EXPECT_NEAR(at(14.99), 32, 1e-3);
  EXPECT_NEAR(at(16), 32 * 0.8, 1e-3);
  EXPECT_NEAR(at(19), 32 * 0.2, 1e-3);
  EXPECT_EQ(at(20.01), 0);
  EXPECT_EQ(at(180), 0);
}

// Light from far beyond where cubes of distances are numbers in single precision.
TEST(Light, FarAndTinyAreaLightsGiveNumbers) {
  for (const float scale : {1e-12f, 1e9f}) {
    Scene scene;
    add_area_light(scene, placed(flipped(make_rectangle()), scale, {0, 0, 2 * scale}), Rgb(1, 1, 1));
    const World world = make_world(scene, true);
    EXPECT_NEAR(integrate(world, Vec3(0), [](const Vec3& d) { return d.z; }), 0.75227, 2e-3) << scale;
  }
}

Rgb bounced(const World& world, const Ray& ray, int bounces, std::uint64_t key) {
  PathRay path;
  path.ray = ray;
  path.emission = false;
  return trace_light(world, path, bounces, key);
}

TEST(Light, BouncedLightMissesAndStops) {
  Scene scene;
  add_shape(scene, make_rectangle(), add_diffuse(scene, Rgb(0.5f, 0.5f, 0.5f)));
  add_directional_light(scene, Vec3(0, 0, -1), Rgb(kPi, kPi, kPi));
  add_area_light(scene, placed(flipped(make_rectangle()), 1e-3f, {50, 0, 5}), Rgb(1000, 1000, 1000));
  const World world = make_world(scene, true);
  EXPECT_NEAR(bounced(world, {{0, 0, 1}, {0, 0, -1}}, 1, 5).x, 0.5f, 0.01f);
  EXPECT_TRUE(is_black(bounced(world, {{0, 0, 1}, {0, 0, -1}}, 0, 5)));
  EXPECT_TRUE(is_black(bounced(world, {{3, 0, 1}, {0, 0, -1}}, 1, 5)));  // past it
  EXPECT_TRUE(is_black(bounced(world, {{0, 0, -1}, {0, 0, 1}}, 1, 5)));  // from behind
  EXPECT_TRUE(is_black(bounced(world, {{50, 0, 1}, {0, 0, 1}}, 1, 5)));  // emission is no bounce
}

// Between two parallel planes that fill each other's hemisphere, the lower one lit evenly with E: radiance
// of the lower one is a E / pi (1 + a^2 + a^4 + ...), a term every other bounce.
TEST(Light, BouncesBetweenTwoPlanes) {
  Scene scene;
  const Rgb albedo(0.4f, 0.7f, 0.9f);
  const int surface = add_diffuse(scene, albedo);
  add_shape(scene, placed(make_rectangle(), 5000, Vec3(0)), surface);
  add_shape(scene, placed(flipped(make_rectangle()), 5000, {0, 0, 1}), surface);
  add_directional_light(scene, {0, 0, -1}, Rgb(1, 1, 1));
  const World world = make_world(scene, false);  // no shadows: the light passes the upper plane
  for (const int bounces : {1, 2, 3, 5, kUnlimitedBounces}) {
    Rgb sum(0, 0, 0);
    constexpr int kPaths = 100000;
    for (std::uint64_t s = 0; s < kPaths; ++s)
      sum += bounced(world, {{0, 0, 0.5f}, {0, 0.6f, -0.8f}}, bounces, hash_words(s, 8)) / kPaths;
    for (int k = 0; k < 3; ++k) {
      const double a = static_cast<double>(albedo[k]);
      double expected = 0;
      for (int n = 1; n <= std::min(bounces, 400); n += 2) expected += std::pow(a, n) / kPiD;
      EXPECT_NEAR(sum[k] / expected, 1, 0.01) << bounces << " bounces, channel " << k;
    }
  }
}

}  // namespace
}  // namespace nacre
