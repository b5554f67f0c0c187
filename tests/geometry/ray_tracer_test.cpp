// label: analytic
#include "nacre/geometry/ray_tracer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "nacre/base/parallel.h"
#include "nacre/base/random.h"
#include "nacre/geometry/primitives.h"
#include "nacre/geometry/subdivide.h"

namespace nacre {
namespace {

Mesh place_mesh(Mesh mesh, double scale, const Vec3d& move) {
  Matrix4 m;
  m.setScale(Vec3d(scale));
  for (int i = 0; i < 3; ++i) m[3][i] = move[i];
  transform_mesh(mesh, m, "test");
  return mesh;
}

Vec3 random_direction(Rng& rng) {
  const float z = 2 * rng.next_float() - 1, phi = 2 * kPi * rng.next_float();
  const float r = std::sqrt(std::max(0.0f, 1 - z * z));
  return {r * std::cos(phi), r * std::sin(phi), z};
}

TEST(RayTracer, HitsSphereWhereItIs) {
  const Mesh sphere = make_sphere();
  const Mesh* meshes[] = {&sphere};
  const RayTracer tracer(meshes);
  for (std::uint64_t i = 0; i < 20'000; ++i) {
    Rng rng(i);
    const Vec3 target = random_direction(rng) * (0.99f * std::cbrt(rng.next_float()));
    const Vec3 origin = random_direction(rng) * 5.0f;
    const Ray ray{origin, (target - origin) * 3.0f};  // any length
    const Hit hit = tracer.intersect(ray);
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit.mesh, 0u);
    const Vec3 position = hit_position(sphere, hit);
    EXPECT_LT((position - (origin + ray.direction * hit.t)).length(), 1e-5f);
    EXPECT_NEAR(position.length(), 1, 8e-5);
    EXPECT_LT((shading_normal(sphere, hit) - position.normalized()).length(), 1e-4f);
    EXPECT_LT(dot(face_normal(sphere, hit.triangle), ray.direction), 0);  // the near side
    EXPECT_TRUE(tracer.occluded(ray));
    // From inside: both sides of a triangle are hit.
    EXPECT_TRUE(tracer.intersect({target, origin - target}));
  }
}

TEST(RayTracer, BarycentricsBelongToSecondAndThirdVertex) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.normals = {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  const Mesh* meshes[] = {&mesh};
  const RayTracer tracer(meshes);
  const Hit hit = tracer.intersect({{0.25f, 0.5f, 2}, {0, 0, -1}});
  ASSERT_TRUE(hit);
  EXPECT_FLOAT_EQ(hit.t, 2);
  EXPECT_FLOAT_EQ(hit.u, 0.25f);
  EXPECT_FLOAT_EQ(hit.v, 0.5f);
  EXPECT_LT((shading_normal(mesh, hit) - Vec3(0.25f, 0.5f, 0.25f).normalized()).length(), 1e-6f);
  mesh.normals.clear();
  EXPECT_EQ(shading_normal(mesh, hit), Vec3(0, 0, 1));
}

TEST(RayTracer, RespectsInterval) {
  const Mesh rectangle = make_rectangle();
  const Mesh* meshes[] = {&rectangle};
  const RayTracer tracer(meshes);
  const auto both = [&](float t_min, float t_max) {
    const Ray ray{{0.1f, 0.2f, 2}, {0, 0, -0.5f}, t_min, t_max};  // hits at t = 4
    const bool hit{tracer.intersect(ray)};
    EXPECT_EQ(hit, tracer.occluded(ray));
    return hit;
  };
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const float nan = std::nanf("");
  EXPECT_TRUE(both(0, kInfinity));
  EXPECT_TRUE(both(-7, kInfinity));
  EXPECT_TRUE(both(3.99f, 4.01f));
  EXPECT_FALSE(both(0, 3.99f));
  EXPECT_FALSE(both(4.01f, kInfinity));
  EXPECT_FALSE(both(5, 3));
  EXPECT_FALSE(both(-9, -1));
  EXPECT_FALSE(both(nan, kInfinity));
  EXPECT_FALSE(both(0, nan));
}

TEST(RayTracer, MasksAndEmptyMeshes) {
  const Mesh empty;
  const Mesh front = place_mesh(make_rectangle(), 1, {0, 0, 1}), back = make_rectangle();
  const Mesh* meshes[] = {&empty, &front, &empty, &back};
  const std::uint32_t masks[] = {~0u, 1, ~0u, 6};
  const RayTracer tracer(meshes, masks);
  const Ray ray{{0.1f, 0.2f, 5}, {0, 0, -1}};
  EXPECT_EQ(tracer.intersect(ray).mesh, 1u);
  EXPECT_EQ(tracer.intersect(ray, 1).mesh, 1u);
  EXPECT_EQ(tracer.intersect(ray, 2).mesh, 3u);
  EXPECT_EQ(tracer.intersect(ray, 12).mesh, 3u);
  EXPECT_FALSE(tracer.intersect(ray, 8));
  EXPECT_TRUE(tracer.occluded(ray, 4));
  EXPECT_FALSE(tracer.occluded(ray, 8));
  EXPECT_EQ(tracer.bounds().min, Vec3(-1, -1, 0));
  EXPECT_EQ(tracer.bounds().max, Vec3(1, 1, 1));
}

TEST(RayTracer, NothingAtAll) {
  RayTracer tracer{std::span<const Mesh* const>()};
  EXPECT_FALSE(tracer.intersect({Vec3(0), Vec3(0, 0, 1)}));
  EXPECT_FALSE(tracer.occluded({Vec3(0), Vec3(0, 0, 1)}));
  EXPECT_TRUE(tracer.bounds().isEmpty());
  const Mesh cube = make_cube();
  const Mesh* meshes[] = {&cube};
  tracer = RayTracer(meshes);
  EXPECT_TRUE(tracer.intersect({Vec3(0), Vec3(0, 0, 1)}));
}

TEST(RayTracer, Watertight) {
  // Rays through shared edges of a closed mesh: none gets out.
  Warnings warnings;
  const Mesh blob = subdivide_loop(make_cube(), 4, "test", warnings);
  const Mesh* meshes[] = {&blob};
  const RayTracer tracer(meshes);
  for (std::size_t i = 0; i < blob.triangles.size(); ++i) {
    const Triangle& t = blob.triangles[i];
    const Vec3& a = blob.positions[t[0]];
    const Vec3& b = blob.positions[t[1]];
    for (const float w : {0.01f, 0.25f, 0.5f, 0.777f})
      ASSERT_TRUE(tracer.intersect({Vec3(0.01f, 0.02f, 0.03f), a + (b - a) * w - Vec3(0.01f, 0.02f, 0.03f)}));
  }
}

// Leaves the surface from random points of a convex mesh, edges and vertices among them, on the outside in
// directions down to grazing; and on the inside, where the first hit has to be elsewhere.
struct Leaving {
  std::size_t rays = 0, self_hits = 0;
  double largest_offset = 0;
};
Leaving leave_surface(const Mesh& mesh, bool convex) {
  const Mesh* meshes[] = {&mesh};
  const RayTracer tracer(meshes);
  Leaving result;
  for (std::uint64_t i = 0; i < 100'000; ++i) {
    Rng rng(i);
    Hit hit;
    hit.triangle = static_cast<std::uint32_t>(rng.next_double() * static_cast<double>(mesh.triangles.size()));
    hit.u = rng.next_float();
    hit.v = rng.next_float() * (1 - hit.u);
    if (i % 8 == 1) hit.u = 0;
    if (i % 8 == 2) hit.v = 0;
    if (i % 8 == 3) hit.v = 1 - hit.u;
    if (i % 8 == 4) hit.u = hit.v = 0;
    const bool outside = i % 16 < 8;
    const Vec3 normal = face_normal(mesh, hit.triangle) * (outside ? 1.0f : -1.0f);
    if (normal == Vec3(0)) continue;
    const Vec3 position = hit_position(mesh, hit);
    const Vec3 origin = offset_from_surface(position, normal, triangle_extent(mesh, hit.triangle));
    result.largest_offset = std::max(result.largest_offset, double{(origin - position).length()});
    float cosine = rng.next_float();
    if (i % 32 >= 16) cosine *= 1e-3f;
    const float phi = 2 * kPi * rng.next_float(), sine = std::sqrt(1 - cosine * cosine);
    const Ray ray{origin, make_frame(normal).to_world({sine * std::cos(phi), sine * std::sin(phi), cosine})};
    const Hit next = tracer.intersect(ray);
    ++result.rays;
    if (next && (next.triangle == hit.triangle || (convex && outside))) ++result.self_hits;
    if (convex && outside && tracer.occluded(ray)) ++result.self_hits;
  }
  return result;
}

TEST(Offset, RaysLeaveSpheresOfEverySizeAndPlace) {
  for (const double radius : {1e-6, 1e-3, 1.0, 1e3, 1e6}) {
    const Leaving leaving = leave_surface(place_mesh(make_sphere(), radius, Vec3(0)), true);
    EXPECT_EQ(leaving.self_hits, 0u) << radius;
    EXPECT_LT(leaving.largest_offset, 2e-6 * radius);
    // Off the origin the coordinates have fewer bits for the shape: the mesh is no longer convex.
    const Leaving moved =
        leave_surface(place_mesh(make_sphere(), radius, Vec3d(-700, 300, 1000) * radius), false);
    EXPECT_EQ(moved.self_hits, 0u) << radius;
    EXPECT_LT(moved.largest_offset, 2e-6 * 1000 * radius);
  }
}

TEST(Offset, RaysLeaveBumpyMeshes) {
  Mesh bumpy = make_sphere();
  for (Vec3& p : bumpy.positions) p *= 1 + 0.3f * std::sin(9 * p.x) * std::sin(7 * p.y) * std::cos(8 * p.z);
  for (const double scale : {1e-6, 1.0, 1e6}) {
    EXPECT_EQ(leave_surface(place_mesh(bumpy, scale, Vec3d(0)), false).self_hits, 0u);
    EXPECT_EQ(leave_surface(place_mesh(bumpy, scale, Vec3d(3, -2, 5) * scale), false).self_hits, 0u);
  }
}

TEST(Offset, RaysLeaveLargeTrianglesNearOrigin) {
  // Slanted through the origin, where the points' own coordinates say nothing about the rounding errors.
  Mesh mesh;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    Rng rng(i);
    const Vec3 a = random_direction(rng) * 1e4f, b = random_direction(rng) * 1e4f;
    mesh.positions.insert(mesh.positions.end(), {a, b, -(a + b) * (0.5f + rng.next_float())});
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const Mesh* meshes[] = {&mesh};
  const RayTracer tracer(meshes);
  for (std::uint32_t i = 0; i < 100'000; ++i) {
    Rng rng(i);
    Hit hit;
    hit.triangle = i % 1000;
    hit.u = hit.v = 1.0f / 3 + 1e-4f * rng.next_float();
    const Vec3 normal = face_normal(mesh, hit.triangle);
    const Vec3 origin =
        offset_from_surface(hit_position(mesh, hit), normal, triangle_extent(mesh, hit.triangle));
    const Vec3 random = random_direction(rng);
    const Vec3 direction = dot(random, normal) < 0 ? -random : random;
    ASSERT_NE(tracer.intersect({origin, direction}).triangle, hit.triangle);
  }
}

TEST(Offset, RaysLeaveNeedles) {
  Warnings warnings;
  EXPECT_EQ(leave_surface(make_disk(), false).self_hits, 0u);
  EXPECT_EQ(leave_surface(make_cylinder({10, 20, 30}, {11, 22, 35}, 0.01f, "test"), false).self_hits, 0u);
  // Flat obtuse triangles, whose planes are ill defined.
  Mesh needles;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    Rng rng(i);
    const Vec3 a = random_direction(rng), b = random_direction(rng);
    const Vec3 c = a + (b - a) * rng.next_float() + random_direction(rng) * 1e-3f;
    needles.positions.insert(needles.positions.end(), {a, b, c});
    needles.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  EXPECT_EQ(leave_surface(needles, false).self_hits, 0u);
}

TEST(Offset, ExtentIsDiameterOfCircumscribedCircle) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {3, 0, 0}, {0, 4, 0}, {1.5f, 1e-9f, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 1, 3}, {0, 0, 0}};
  EXPECT_FLOAT_EQ(triangle_extent(mesh, 0), 5);
  EXPECT_FLOAT_EQ(triangle_extent(mesh, 1), 1024 * 3);
  EXPECT_EQ(triangle_extent(mesh, 2), 0);
}

TEST(RayTracer, ThreadsAgree) {
  const Mesh sphere = make_sphere(), cube = make_cube();
  const Mesh* meshes[] = {&sphere, &cube};
  const RayTracer tracer(meshes);
  constexpr std::size_t kCount = 20'000;
  const auto ray_of = [](std::size_t i) {
    Rng rng(i);
    const Vec3 origin = random_direction(rng) * 3.0f;
    return Ray{origin, random_direction(rng) - origin};
  };
  std::vector<Hit> together(kCount);
  parallel_for(kCount, 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) together[i] = tracer.intersect(ray_of(i));
  });
  for (std::size_t i = 0; i < kCount; ++i) {
    const Hit alone = tracer.intersect(ray_of(i));
    ASSERT_EQ(alone.t, together[i].t);
    ASSERT_EQ(alone.triangle, together[i].triangle);
  }
}

TEST(Collect, FindsEveryTriangleOnceInOrder) {
  // Sheets at random heights, some of them at the same one, each of two meshes.
  Mesh sheets[2];
  std::vector<std::pair<float, std::uint32_t>> expected;
  for (std::uint32_t i = 0; i < 200; ++i) {
    const float z = static_cast<float>(hash_words(i / 2) % 1000) / 10;
    Mesh& mesh = sheets[i % 3 == 0];
    const auto base = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {{-9, -9, z}, {9, -9, z}, {0, 9, z}});
    mesh.triangles.push_back({base, base + 1, base + 2});
    expected.emplace_back(z, i % 3 == 0);
  }
  std::ranges::sort(expected);
  const Mesh* meshes[] = {&sheets[0], &sheets[1]};
  const RayTracer tracer(meshes);
  const std::uint8_t all[] = {1, 1}, first[] = {1, 0};
  std::vector<Hit> hits;
  ASSERT_TRUE(tracer.collect({{0.1f, 0.2f, -1}, {0, 0, 1}}, all, hits));
  ASSERT_EQ(hits.size(), expected.size());
  for (std::size_t i = 0; i < hits.size(); ++i) EXPECT_NEAR(hits[i].t - 1, expected[i].first, 1e-4);
  EXPECT_TRUE(std::ranges::is_sorted(hits, {}, &Hit::t));
  ASSERT_TRUE(tracer.collect({{0.1f, 0.2f, -1}, {0, 0, 1}, 0, 51}, all, hits));
  EXPECT_LT(hits.size(), expected.size());
  EXPECT_FALSE(tracer.collect({{0.1f, 0.2f, -1}, {0, 0, 1}}, first, hits));
  EXPECT_TRUE(tracer.collect({{50, 0.2f, -1}, {0, 0, 1}}, first, hits));
  EXPECT_TRUE(hits.empty());
  // Ordinary rays are none the wiser.
  EXPECT_NEAR(tracer.intersect({{0.1f, 0.2f, -1}, {0, 0, 1}}).t - 1, expected[0].first, 1e-4);
}

}  // namespace
}  // namespace nacre
