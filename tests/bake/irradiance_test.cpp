// label: analytic
// Transmitted irradiance against closed forms.
#include <gtest/gtest.h>

#include <cstring>

#include "nacre/bake/bake.h"
#include "nacre/base/parallel.h"
#include "nacre/base/random.h"
#include "nacre/optics/fresnel.h"
#include "transport/scene_parts.h"

namespace nacre {
namespace {

using namespace testing_support;

constexpr float kEta = 1.3f;

double transmittance(double cosine) { return 1 - fresnel_reflectance(cosine, static_cast<double>(kEta)); }

// E_t at a point that faces `normal`, the mean over `repeats` independent estimates.
Rgb irradiance_at(const Scene& scene, const Vec3& position, const Vec3& normal, int samples = 64,
                  int bounces = 0, bool shadows = true, std::size_t repeats = 1) {
  const World world = make_world(scene, shadows);
  const std::vector<Vec3> positions(repeats, position), normals(repeats, normal);
  const std::vector<float> extents(repeats, 1.0f);
  Progress progress;
  const auto values = compute_irradiance(world, {positions, normals, extents}, kEta,
                                         {samples, bounces, 0, false, 11}, progress);
  Rgb sum(0, 0, 0);
  for (const Rgb& value : values.irradiance) sum += value / static_cast<float>(repeats);
  return sum;
}

void expect_rgb(const Rgb& value, const Rgb& per_unit, double unit, double tolerance) {
  for (int k = 0; k < 3; ++k) {
    const double expected = static_cast<double>(per_unit[k]) * unit;
    EXPECT_NEAR(value[k], expected, tolerance * expected) << "channel " << k;
  }
}

const Vec3 kUp(0, 0, 1);
const Rgb kSpectrum(1, 2, 0.5f);

TEST(Irradiance, DirectionalLight) {
  for (const double degrees : {0.0, 30.0, 60.0, 80.0, 89.0}) {
    const double cosine = std::cos(degrees * kPiD / 180);
    Scene scene;
    add_directional_light(
        scene, Vec3(static_cast<float>(std::sqrt(1 - cosine * cosine)), 0, static_cast<float>(-cosine)),
        kSpectrum);
    expect_rgb(irradiance_at(scene, {3, 4, 5}, kUp), kSpectrum, cosine * transmittance(cosine), 1e-4);
    EXPECT_TRUE(is_black(irradiance_at(scene, {3, 4, 5}, -kUp)));
  }
}

TEST(Irradiance, PointLightFallsOffWithTheSquare) {
  const Vec3 at(1, -2, 0.5f);
  for (const float distance : {0.1f, 1.0f, 7.0f}) {
    Scene scene;
    const Vec3 direction = Vec3(2, 1, 3).normalized();
    add_point_light(scene, at + direction * distance, kSpectrum);
    const double cosine = static_cast<double>(direction.z);
    expect_rgb(irradiance_at(scene, at, kUp), kSpectrum,
               cosine * transmittance(cosine) / square(static_cast<double>(distance)), 1e-4);
    EXPECT_TRUE(is_black(irradiance_at(scene, at, -kUp)));
  }
}

TEST(Irradiance, PointLightAtTheReceiver) {
  Scene scene;
  add_point_light(scene, {1, 1, 1}, kSpectrum);
  EXPECT_TRUE(is_black(irradiance_at(scene, {1, 1, 1}, kUp)));
}

TEST(Irradiance, LightsAdd) {
  Scene scene;
  for (int i = 0; i < 3; ++i) add_directional_light(scene, -kUp, kSpectrum);
  expect_rgb(irradiance_at(scene, Vec3(0), kUp), kSpectrum, 3 * transmittance(1), 1e-5);
}

// A rectangle of half sides a and b at height h, facing down, whose centre is at (x, y) from the receiver.
double rectangle_quadrature(double a, double b, double x, double y, double h) {
  constexpr int kSide = 800;
  double sum = 0;
  for (int i = 0; i < kSide; ++i)
    for (int j = 0; j < kSide; ++j) {
      const double px = x + a * (2 * (i + 0.5) / kSide - 1), py = y + b * (2 * (j + 0.5) / kSide - 1);
      const double d2 = px * px + py * py + h * h, cosine = h / std::sqrt(d2);
      sum += transmittance(cosine) * cosine * cosine / d2;
    }
  return sum * 4 * a * b / (kSide * kSide);
}

Mesh ceiling(float a, float b, const Vec3& centre) {
  return placed(flipped(make_rectangle()), {a, b, 1}, centre);
}

TEST(Irradiance, RectangleLight) {
  Scene scene;
  add_area_light(scene, ceiling(0.8f, 0.5f, {0.3f, -0.6f, 1.2f}), kSpectrum);
  expect_rgb(irradiance_at(scene, Vec3(0), kUp, 1 << 14), kSpectrum,
             rectangle_quadrature(0.8, 0.5, 0.3, -0.6, 1.2), 2e-3);
  // A few samples each are right in the mean.
  expect_rgb(irradiance_at(scene, Vec3(0), kUp, 4, 0, true, 8192), kSpectrum,
             rectangle_quadrature(0.8, 0.5, 0.3, -0.6, 1.2), 5e-3);
  // Its back is dark.
  EXPECT_TRUE(is_black(irradiance_at(scene, {0, 0, 3}, -kUp)));
}

// Uniform radiance L over the hemisphere transmits pi L times the mean transmittance.
TEST(Irradiance, HugeRectangleLight) {
  Scene scene;
  add_area_light(scene, ceiling(40, 40, {0, 0, 1}), kSpectrum);
  const double expected = rectangle_quadrature(40, 40, 0, 0, 1);
  EXPECT_NEAR(expected / (kPiD * mean_transmittance(static_cast<double>(kEta))), 1, 2e-3);
  expect_rgb(irradiance_at(scene, Vec3(0), kUp, 1 << 16, 0, true, 4), kSpectrum, expected, 0.01);
}

TEST(Irradiance, InsideAnEmittingSphere) {
  Scene scene;
  add_area_light(scene, placed(flipped(make_sphere()), 2, {1, 1, 1}), kSpectrum);
  const double expected = kPiD * mean_transmittance(static_cast<double>(kEta));
  expect_rgb(irradiance_at(scene, {1, 1, 1}, kUp, 1 << 12, 0, true, 4), kSpectrum, expected, 3e-3);
  expect_rgb(irradiance_at(scene, {1.5f, 0.3f, 1}, Vec3(1, 2, -1).normalized(), 1 << 12, 0, true, 4),
             kSpectrum, expected, 3e-3);
}

TEST(Irradiance, UnderAnEmittingSphere) {
  // It fills a cone of half angle asin(1/2) around the normal.
  Scene scene;
  add_area_light(scene, placed(make_sphere(), 0.5f, {0, 0, 1}), kSpectrum);
  constexpr int kSteps = 10000;
  const double edge = std::sqrt(0.75);
  double expected = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double cosine = edge + (1 - edge) * (i + 0.5) / kSteps;
    expected += 2 * kPiD * (1 - edge) / kSteps * cosine * transmittance(cosine);
  }
  expect_rgb(irradiance_at(scene, Vec3(0), kUp, 1 << 13, 0, true, 64), kSpectrum, expected, 2e-3);
}

TEST(Irradiance, Shadows) {
  for (int light = 0; light < 3; ++light) {
    Scene scene;
    if (light == 0) add_directional_light(scene, -kUp, kSpectrum);
    if (light == 1) add_point_light(scene, {0, 0, 2}, kSpectrum);
    if (light == 2) add_area_light(scene, ceiling(0.2f, 0.2f, {0, 0, 2}), kSpectrum);
    const Rgb open = irradiance_at(scene, Vec3(0), kUp);
    EXPECT_GT(min_channel(open), 0);
    add_shape(scene, placed(make_rectangle(), 1, {0, 0, 1}));
    EXPECT_TRUE(is_black(irradiance_at(scene, Vec3(0), kUp)));
    EXPECT_EQ(irradiance_at(scene, Vec3(0), kUp, 64, 0, false), open);
    // Behind the light, or behind the receiver, it does not matter.
    scene.shapes.back().mesh = placed(make_rectangle(), 1, {0, 0, light == 0 ? -0.1f : 2.1f});
    EXPECT_EQ(irradiance_at(scene, Vec3(0), kUp), open);
  }
}

TEST(Irradiance, HalfHiddenAreaLight) {
  Scene scene;
  add_area_light(scene, ceiling(0.5f, 0.5f, {0, 0, 2}), kSpectrum);
  add_shape(scene, placed(make_rectangle(), 3, {3, 0, 1}));  // all of x > 0
  expect_rgb(irradiance_at(scene, Vec3(0), kUp, 1 << 14), kSpectrum,
             rectangle_quadrature(0.25, 0.5, -0.25, 0, 2), 5e-3);
}

// Light all around: what enters is the mean transmittance of pi L, without noise, for a constant one.
TEST(Irradiance, ConstantLight) {
  Scene scene;
  add_constant_light(scene, kSpectrum);
  const double expected = kPiD * mean_transmittance(static_cast<double>(kEta));
  expect_rgb(irradiance_at(scene, {1, 2, 3}, Vec3(0.6f, 0, 0.8f), 1024), kSpectrum, expected, 1e-3);
  expect_rgb(irradiance_at(scene, {1, 2, 3}, -kUp, 16, 0, true, 1024), kSpectrum, expected, 1e-3);
  // Half of the sky is behind a wall that is all but infinite.
  Mesh wall = placed(make_rectangle(), 1e5f, Vec3(0));
  for (Vec3& p : wall.positions) p = {1e-3f, p.x, p.y};
  add_shape(scene, wall);
  expect_rgb(irradiance_at(scene, Vec3(0), kUp, 1 << 14), kSpectrum, expected / 2, 5e-3);
}

TEST(Irradiance, EvenEnvironmentMapIsAConstantLight) {
  Scene scene;
  EnvironmentMap map;
  map.radiance = {8, 4, std::vector<Rgb>(32, kSpectrum)};
  scene.lights.push_back({"", "", map});
  const double expected = kPiD * mean_transmittance(static_cast<double>(kEta));
  for (const Vec3& normal : {Vec3(0, 0, 1), Vec3(0, -1, 0), Vec3(0.6f, 0.48f, -0.64f)})
    expect_rgb(irradiance_at(scene, Vec3(0), normal, 1 << 16), kSpectrum, expected, 2e-3);
}

TEST(Irradiance, SpotLight) {
  Scene scene;
  SpotLight spot;
  spot.position = {0, 0, 2};
  spot.direction = {0, 0, -1};
  spot.intensity = kSpectrum;
  scene.lights.push_back({"", "", spot});
  for (const auto& [degrees, part] : {std::pair{0.0, 1.0}, {14.9, 1.0}, {17.5, 0.5}, {19.0, 0.2}}) {
    const double cosine = std::cos(degrees * kPiD / 180), distance2 = square(2 / cosine);
    const Vec3 at(static_cast<float>(2 * std::tan(degrees * kPiD / 180)), 0, 0);
    expect_rgb(irradiance_at(scene, at, kUp), kSpectrum, part * cosine * transmittance(cosine) / distance2,
               1e-3);
  }
  EXPECT_TRUE(is_black(irradiance_at(scene, {0.74f, 0, 0}, kUp)));
  EXPECT_TRUE(is_black(irradiance_at(scene, {0, 0, 4}, -kUp)));
}

// More lights than are all connected to.
TEST(Irradiance, OfManyLightsIsTheirSum) {
  Scene scene;
  double expected = 0;
  for (int i = 0; i < 40; ++i) {
    const Vec3 p(static_cast<float>(i % 7) - 3, static_cast<float>(i % 5) - 2,
                 1 + 0.1f * static_cast<float>(i));
    add_point_light(scene, p, kSpectrum);
    const double distance = static_cast<double>(p.length()), cosine = static_cast<double>(p.z) / distance;
    expected += cosine * transmittance(cosine) / square(distance);
  }
  expect_rgb(irradiance_at(scene, Vec3(0), kUp, 1 << 12), kSpectrum, expected, 3e-3);
  expect_rgb(irradiance_at(scene, Vec3(0), kUp, 1, 0, true, 1 << 12), kSpectrum, expected, 1e-2);
}

// A sample on a closed translucent shape is not in the shadow of the triangle that it lies on.
TEST(Irradiance, SurfacesDoNotShadowThemselves) {
  Scene scene;
  add_shape(scene, placed(make_sphere(), 1, {100, 0, 0}));
  add_directional_light(scene, -kUp, kSpectrum);
  const Mesh& mesh = scene.shapes[0].mesh;
  std::vector<Vec3> positions, normals;
  std::vector<float> extents;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); t += 7) {
    if (face_normal(mesh, t).z < 0.05f) continue;
    positions.push_back(hit_position(mesh, {0, 0, t, 0.3f, 0.4f}));
    normals.push_back(face_normal(mesh, t));
    extents.push_back(triangle_extent(mesh, t));
  }
  const World world = make_world(scene, true);
  Progress progress;
  for (const Rgb& e :
       compute_irradiance(world, {positions, normals, extents}, kEta, {1, 0, 0, false, 1}, progress)
           .irradiance)
    EXPECT_GT(e.x, 0);
}

// A receiver that looks down on a floor so large that it fills the hemisphere, lit from above.
TEST(Irradiance, OneBounceOffALargeFloor) {
  Scene scene;
  const Rgb albedo(0.8f, 0.5f, 0.2f);
  add_shape(scene, placed(make_rectangle(), 3000, Vec3(0)), add_diffuse(scene, albedo));
  add_directional_light(scene, Vec3(1, 0, -1), Rgb(2, 2, 2));
  const double floor = 2 / std::sqrt(2.0), through = mean_transmittance(static_cast<double>(kEta));
  const Vec3 at(0.3f, 0.2f, 1);
  expect_rgb(irradiance_at(scene, at, -kUp, 1 << 14, 1), albedo, floor * through, 2e-3);
  expect_rgb(irradiance_at(scene, at, -kUp, 16, 1, true, 4096), albedo, floor * through, 5e-3);
  EXPECT_TRUE(is_black(irradiance_at(scene, at, -kUp, 64, 0)));
  // More bounces find nothing else.
  expect_rgb(irradiance_at(scene, at, -kUp, 1 << 14, 4), albedo, floor * through, 2e-3);
}

TEST(Irradiance, NothingBouncesOffTranslucentOrBackFaces) {
  Scene scene;
  add_shape(scene, placed(make_rectangle(), 3000, Vec3(0)), kNone,
            add_medium(scene, make_medium(presets()[0])));
  add_directional_light(scene, -kUp, kSpectrum);
  EXPECT_TRUE(is_black(irradiance_at(scene, {0, 0, 1}, -kUp, 256, 3)));
  scene.shapes[0].medium = kNone;
  EXPECT_FALSE(is_black(irradiance_at(scene, {0, 0, 1}, -kUp, 256, 3)));
  flip_normals(scene.shapes[0].mesh);
  EXPECT_TRUE(is_black(irradiance_at(scene, {0, 0, 1}, -kUp, 256, 3)));
}

// In an integrating sphere with the light in the middle, bounce n gives everything the same radiance:
// albedo^n times what falls on the wall directly. A receiver that turns its back on the light gets just that.
TEST(Irradiance, BouncesInAnIntegratingSphere) {
  const Rgb albedo(0.5f, 0.8f, 1);
  for (const int bounces : {1, 2, 3, 6}) {
    Scene scene;
    const float radius = 2;
    add_shape(scene, placed(flipped(make_sphere()), radius, Vec3(0)), add_diffuse(scene, albedo));
    add_point_light(scene, Vec3(0), Rgb(1, 1, 1));
    Rgb series(0, 0, 0), power(1, 1, 1);
    for (int n = 1; n <= bounces; ++n) series += power *= albedo;
    const double unit = mean_transmittance(static_cast<double>(kEta)) / square(static_cast<double>(radius));
    expect_rgb(irradiance_at(scene, {0, 0, 1}, kUp, 64, bounces, true, 512), series, unit, 0.01);
  }
}
TEST(Irradiance, UnlimitedBounces) {
  Scene scene;
  add_shape(scene, flipped(make_sphere()), add_diffuse(scene, Rgb(0.2f, 0.5f, 0.75f)));
  add_point_light(scene, Vec3(0), Rgb(1, 1, 1));
  expect_rgb(irradiance_at(scene, {0, 0, 0.5f}, kUp, 64, kUnlimitedBounces, true, 512), Rgb(0.25f, 1, 3),
             mean_transmittance(static_cast<double>(kEta)), 0.01);
}

TEST(Irradiance, DependsOnSeedButNotOnThreads) {
  Scene scene;
  add_area_light(scene, ceiling(1, 1, {0, 0, 2}), kSpectrum);
  add_shape(scene, placed(make_rectangle(), 5, {0, 0, -1}));
  const World world = make_world(scene, true);
  std::vector<Vec3> positions, normals;
  Rng rng(4);
  for (int i = 0; i < 2000; ++i) {
    positions.emplace_back(rng.next_float(), rng.next_float(), rng.next_float());
    normals.push_back(sample_uniform_sphere(rng.next_2d()));
  }
  const std::vector<float> extents(positions.size(), 0.1f);
  const auto run = [&](std::uint64_t seed) {
    Progress progress;
    return compute_irradiance(world, {positions, normals, extents}, kEta, {8, 2, 0, false, seed}, progress)
        .irradiance;
  };
  std::vector<Rgb> one, two;
  {
    const ThreadLimit limit(1);
    one = run(1);
  }
  {
    const ThreadLimit limit(2);
    two = run(1);
  }
  EXPECT_EQ(std::memcmp(one.data(), two.data(), one.size() * sizeof(Rgb)), 0);
  EXPECT_NE(one, run(2));
  for (const Rgb& e : one) EXPECT_TRUE(is_finite(e) && min_channel(e) >= 0);
}

}  // namespace
}  // namespace nacre
