// label: analytic
// Paths: known radiances, and the weights between connections and rays.
#include "nacre/transport/path.h"

#include <gtest/gtest.h>

#include "nacre/base/random.h"
#include "transport/scene_parts.h"

namespace nacre {
namespace {

using namespace testing_support;

PathRay from_eye(const Vec3& origin, const Vec3& direction) {
  PathRay ray;
  ray.ray = {origin, direction.normalized()};
  return ray;
}

int add_surface(Scene& scene, const Surface& surface) {
  scene.surfaces.push_back(surface);
  return static_cast<int>(scene.surfaces.size()) - 1;
}

struct Statistics {
  double mean = 0, variance = 0;
};
template <class Sample>
Statistics measure(int count, const Sample& sample) {
  double sum = 0, squares = 0;
  for (int i = 0; i < count; ++i) {
    const double value = static_cast<double>(sample(static_cast<std::uint64_t>(i)).y);
    sum += value;
    squares += value * value;
  }
  return {sum / count, squares / count - square(sum / count)};
}

TEST(Path, EmissionIsSeenFromTheFrontAlone) {
  Scene scene;
  add_area_light(scene, make_rectangle(), {1, 2, 3});
  const World world = make_world(scene, true);
  EXPECT_EQ(trace_light(world, from_eye({0, 0, 2}, {0, 0, -1}), 0, 1), Rgb(1, 2, 3));
  EXPECT_EQ(trace_light(world, from_eye({0, 0, -2}, {0, 0, 1}), 0, 1), Rgb(0, 0, 0));
  EXPECT_EQ(trace_light(world, from_eye({0, 0, 2}, {0, 0, 1}), 0, 1), Rgb(0, 0, 0));
}

// Inside a closed room that shines and reflects everywhere radiance is L (1 + a + a^2 + ...) up to the
// bounces.
TEST(Path, FurnaceWithWalls) {
  Scene scene;
  const Rgb albedo(0.5f, 0.7f, 0.2f);
  add_shape(scene, flipped(placed(make_cube(), 3, {0, 0, 0})), add_diffuse(scene, albedo));
  scene.shapes.back().light = 0;
  scene.lights.push_back({"", "", AreaLight{0, {1, 1, 1}}});
  const World world = make_world(scene, true);
  for (const int bounces : {0, 1, 2, 5}) {
    Rgb sum(0, 0, 0);
    constexpr int kPaths = 20000;
    for (std::uint64_t i = 0; i < kPaths; ++i)
      sum += trace_light(world, from_eye({0, 0, 0}, {0.3f, 0.5f, 0.7f}), bounces, hash_words(3, i)) / kPaths;
    for (int k = 0; k < 3; ++k) {
      const double a = static_cast<double>(albedo[k]);
      EXPECT_NEAR(static_cast<double>(sum[k]), (1 - std::pow(a, bounces + 1)) / (1 - a), 0.01)
          << bounces << k;
    }
  }
}

// Direct light from a lamp of any size and distance on surfaces from diffuse to polished: connections and
// rays weighted against each other have the mean of either alone, and never twice the variance of the better.
TEST(Path, WeightsAreNeverMuchWorseThanEitherStrategy) {
  for (const float alpha : {0.0f, 0.05f, 0.2f, 0.6f})  // 0: diffuse
    for (const auto& [size, slope] : {std::pair(0.1f, 1.0f), std::pair(1.0f, 1.0f), std::pair(8.0f, 1.0f),
                                      std::pair(0.5f, 0.05f), std::pair(2.0f, 0.05f)}) {
      Scene scene;
      int surface = 0;
      if (alpha == 0) {
        surface = add_diffuse(scene, {0.8f, 0.8f, 0.8f});
      } else {
        ConductorSurface metal;
        metal.roughness = {alpha, alpha};
        surface = add_surface(scene, {"", "", metal});
      }
      add_shape(scene, placed(make_rectangle(), 1, {0, 0, 0}), surface);
      // Seen from above, or aslant with a lamp that stands upright in the mirror's direction.
      if (slope == 1) {
        add_area_light(scene, flipped(placed(make_rectangle(), size, {-0.5f, 0, 2})), {10, 10, 10});
      } else {
        Mesh lamp = placed(make_rectangle(), size, {0, 0, 0});
        for (Vec3& p : lamp.positions) p = Vec3(-4, p.x, 0.2f + size + p.y);
        lamp.normals.clear();
        add_area_light(scene, std::move(lamp), {10, 10, 10});
      }
      const World world = make_world(scene, true);
      const Vec3 out = (slope == 1 ? Vec3(0.4f, 0.1f, 1) : Vec3(1, 0.02f, slope)).normalized();
      const Hit hit = world.tracer.intersect({{0.1f, 0.1f, 0.5f}, {0, 0, -1}});
      const ScatterPoint at = scatter_point(world, hit, out);
      const PathRay eye = from_eye({0.1f, 0.1f, 0.5f}, {0, 0, -1});
      constexpr int kCount = 40000;
      // Independent samples: a key of its own for each.
      const auto next = [&](std::uint64_t i) { return next_ray(world, at, eye, 1, hash_words(i, 1), 0); };
      const auto emission = [&](const NextRay& ray) {
        return is_black(ray.weight)
                   ? Rgb(0, 0, 0)
                   : ray.weight * emitted_radiance(world, ray.ray, world.tracer.intersect(ray.ray.ray));
      };
      const Statistics connections = measure(kCount, [&](std::uint64_t i) {
        return reflect_direct_light(world, at, 1, hash_words(i, 2), 0, Continuation::kEnds);
      });
      const Statistics rays = measure(kCount, [&](std::uint64_t i) {
        NextRay ray = next(i);
        ray.ray.density = 0;  // all of the emission
        return emission(ray);
      });
      const Statistics both = measure(kCount, [&](std::uint64_t i) {
        return reflect_direct_light(world, at, 1, hash_words(i, 2), 0, Continuation::kGoesOn) +
               emission(next(i));
      });
      const double error =
          std::sqrt((both.variance + std::min(connections.variance, rays.variance)) / kCount);
      const double reference = connections.variance < rays.variance ? connections.mean : rays.mean;
      EXPECT_GT(both.mean, 0);
      EXPECT_NEAR(both.mean, reference, 4 * error + 1e-4 * reference) << alpha << " " << size;
      EXPECT_LT(both.variance, 2 * std::min(connections.variance, rays.variance) + 1e-7 * square(reference))
          << alpha << " " << size << " " << slope << ": " << connections.variance << " " << rays.variance;
    }
}

// Glass lets light through straight, less what its boundaries reflect; rough glass and other bodies do not.
TEST(Path, LightPassesClearGlass) {
  Scene scene;
  add_directional_light(scene, {0, 0, -1}, {1, 1, 1});
  DielectricSurface glass;
  glass.int_ior = 1.5f;
  glass.ext_ior = 1;
  glass.specular_transmittance = {1, 0.5f, 0.25f};
  const int clear = add_surface(scene, {"", "", glass});
  glass.roughness = {0.2f, 0.2f};
  const int rough = add_surface(scene, {"", "", glass});
  const auto see = [&](int surface, bool shadows) {
    if (!scene.shapes.empty()) scene.shapes.pop_back();
    add_shape(scene, placed(make_cube(), 1, {0, 0, 2}), surface);
    const World world = make_world(scene, shadows);
    return see_light(world, {0.1f, 0.2f, 0}, sample_light(world, 0, {0.1f, 0.2f, 0}, {}));
  };
  const Visibility through = see(clear, true);
  EXPECT_TRUE(through.through_glass);
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(through.transmittance[k], 0.96f * 0.96f * square(glass.specular_transmittance[k]), 1e-5f);
  EXPECT_TRUE(is_black(see(rough, true).transmittance));
  EXPECT_TRUE(is_black(see(kNone, true).transmittance));
  EXPECT_EQ(see(kNone, false).transmittance, Rgb(1, 1, 1));
}

// What a translucent shape answers comes back over a diffuse wall.
TEST(Path, TranslucentShapesAnswer) {
  Scene scene;
  add_shape(scene, placed(make_rectangle(), 1000, {0, 0, 0}), add_diffuse(scene, {0.5f, 0.5f, 0.5f}));
  add_shape(scene, placed(flipped(make_rectangle()), 1000, {0, 0, 1}), kNone, add_medium(scene, Medium{}));
  const World world = make_world(scene, true);
  const TranslucentAnswer answer = [&](const Hit& hit, const Vec3& out) {
    EXPECT_EQ(hit.mesh, 1u);
    EXPECT_LT(out.z, 0);
    return Rgb(2, 4, 6);
  };
  EXPECT_EQ(trace_light(world, from_eye({0, 0, 0.5f}, {0, 0, 1}), 0, 1, answer), Rgb(2, 4, 6));
  Rgb sum(0, 0, 0);
  for (std::uint64_t i = 0; i < 1000; ++i)
    sum += trace_light(world, from_eye({0, 0, 0.5f}, {0, 0, -1}), 1, i, answer) / 1000.0f;
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(sum[k], static_cast<float>(k + 1), 0.02f);
  EXPECT_TRUE(is_black(trace_light(world, from_eye({0, 0, 0.5f}, {0, 0, 1}), 3, 1)));
}

}  // namespace
}  // namespace nacre
