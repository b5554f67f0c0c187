// label: unit
// Surfaces in the world: textures where they belong, albedo shared between entry and exit, and no light
// through interpolated normals.
#include "nacre/transport/surface.h"

#include <gtest/gtest.h>

#include "nacre/base/random.h"
#include "transport/scene_parts.h"

namespace nacre {
namespace {

using namespace testing_support;

// 2 x 2 texels: red, green above; blue, white below.
Texture four_texels() {
  BitmapTexture texture;
  texture.bitmap = {2, 2, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}}};
  texture.nearest = true;
  return {"", "", texture};
}

Hit look_down(const World& world, float x, float y) {
  return world.tracer.intersect({{x, y, 3}, {0, 0, -1}});
}

TEST(SurfaceAt, TexturesMultiplyTheirColours) {
  Scene scene;
  scene.textures = {four_texels(), {"", "", CheckerboardTexture{{0.5f, 0.5f, 0.5f}, {0.25f, 0.25f, 0.25f}}}};
  PlasticSurface model;
  model.diffuse_reflectance = {1, 0.5f, 1};
  scene.surfaces.push_back({"", "", model, {0, 1, kNone}});
  add_shape(scene, make_rectangle(), 0);
  const World world = make_world(scene, true);
  // The picture is upright: its upper row is at +y.
  EXPECT_EQ(bsdf_at(world, look_down(world, -0.5f, 0.5f)).diffuse, Rgb(1, 0, 0));
  EXPECT_EQ(bsdf_at(world, look_down(world, 0.5f, 0.5f)).diffuse, Rgb(0, 0.5f, 0));
  EXPECT_EQ(bsdf_at(world, look_down(world, -0.5f, -0.5f)).diffuse, Rgb(0, 0, 1));
  EXPECT_EQ(bsdf_at(world, look_down(world, 0.5f, -0.5f)).diffuse, Rgb(1, 0.5f, 1));
  EXPECT_EQ(bsdf_at(world, look_down(world, 0.5f, 0.5f)).specular_reflectance, Rgb(0.5f));
  EXPECT_EQ(bsdf_at(world, look_down(world, 0.5f, -0.5f)).specular_reflectance, Rgb(0.25f));
}

TEST(SurfaceAt, WithoutCoordinatesBarycentricOnesServe) {
  Mesh mesh = make_rectangle();
  mesh.uvs.clear();
  EXPECT_EQ(texture_coordinates(mesh, {1, 0, 0, 0.25f, 0.5f}), Vec2(0.25f, 0.5f));
}

TEST(SurfaceAlbedo, IsSharedBetweenEntryAndExit) {
  Scene scene;
  scene.textures = {four_texels()};
  const int medium = add_medium(scene, Medium());
  add_shape(scene, make_rectangle(), kNone, medium);
  add_shape(scene, placed(make_rectangle(), 1, {5, 0, 0}));
  SubsurfaceSettings& settings = scene.subsurface[0];
  settings.surface_albedo = {0.5f, 0.25f, 0.8f};
  settings.albedo_texture = 0;
  const World world = make_world(scene, true);
  const Hit white = look_down(world, 0.5f, -0.5f), red = look_down(world, -0.5f, 0.5f);
  for (const float share : {0.0f, 0.3f, 1.0f}) {
    settings.albedo_at_entry = share;
    const Rgb entry = surface_albedo(world, white, true), exit = surface_albedo(world, white, false);
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(entry[k], std::pow(settings.surface_albedo[k], share), 1e-6);
      EXPECT_NEAR(entry[k] * exit[k], settings.surface_albedo[k], 1e-6);
    }
    EXPECT_NEAR(surface_albedo(world, red, true).y * surface_albedo(world, red, false).y, 0, 1e-6);
  }
  EXPECT_EQ(surface_albedo(world, look_down(world, 5, 0), true), Rgb(1, 1, 1));
}

TEST(SurfaceAt, BrushesFollowTheTextureCoordinates) {
  Scene scene;
  scene.surfaces.push_back({"", "", ConductorSurface{{0, 0, 0}, {1, 1, 1}, {1, 1, 1}, {0.05f, 0.5f}}});
  add_shape(scene, make_rectangle(), 0);
  for (Vec2& uv : scene.shapes[0].mesh.uvs) uv = Vec2(-uv.y, uv.x);  // u grows along -y
  const World world = make_world(scene, true);
  const Hit hit = look_down(world, 0.2f, 0.1f);
  const Vec3 up(0, 0, 1);
  const SurfaceBsdf surface = surface_at(world, hit, surface_point(world, hit), up);
  EXPECT_NEAR((surface.frame.s - Vec3(0, -1, 0)).length(), 0, 1e-6);
  EXPECT_NEAR((surface.frame.t - cross(surface.frame.n, surface.frame.s)).length(), 0, 1e-6);
  // Wide across the brushing.
  EXPECT_GT(eval_bsdf(surface, Vec3(0.6f, 0, 0.8f), up).x,
            100 * eval_bsdf(surface, Vec3(0, 0.6f, 0.8f), up).x);
}

// Normals that lean by 40 degrees from a flat triangle.
struct Leaning {
  explicit Leaning(const Surface& surface) {
    scene.surfaces.push_back(surface);
    Mesh mesh = make_rectangle();
    mesh.normals.assign(mesh.normals.size(), Vec3(0.64f, 0, 0.768f).normalized());
    add_shape(scene, std::move(mesh), 0);
    world.push_back(make_world(scene, true));
    hit = look_down(world[0], 0, 0);
    point = surface_point(world[0], hit);
  }
  SurfaceBsdf at(const Vec3& out) const { return surface_at(world[0], hit, point, out); }
  Scene scene;
  std::vector<World> world;
  Hit hit;
  SurfacePoint point;
};

TEST(SurfaceAt, NothingLeaksThroughLeaningNormals) {
  const Leaning diffuse({"", "", DiffuseSurface{{1, 1, 1}}});
  const Leaning glass({"", "", DielectricSurface{1.5f, 1, {1, 1, 1}, {1, 1, 1}, {0.4f, 0.4f}}});
  int shadowed = 0;
  for (std::uint32_t i = 0; i < 4000; ++i) {
    Rng rng(hash_words(i, 3));
    const Vec3 in = sample_uniform_sphere(rng.next_2d()), out = sample_uniform_sphere(rng.next_2d());
    const SurfaceBsdf surface = diffuse.at(out);
    EXPECT_GT(dot(surface.frame.n, out) * out.z, 0);
    const bool black = is_black(eval_bsdf(surface, in, out));
    EXPECT_TRUE(black || (in.z > 0 && out.z > 0)) << in << out;
    shadowed += in.z > 0 && out.z > 0 && black;

    const SurfaceBsdf pane = glass.at(out);
    const BsdfSample sample = sample_bsdf(pane, out, rng.next_float(), rng.next_2d());
    if (is_black(sample.weight)) continue;
    EXPECT_EQ(sample.transmitted, sample.direction.z * out.z < 0);
    EXPECT_NEAR(sample.pdf, pdf_bsdf(pane, sample.direction, out), 2e-3f * sample.pdf);
  }
  EXPECT_GT(shadowed, 0);
}

TEST(SurfaceAt, MirrorsHaveNoDarkRims) {
  const Leaning mirror({"", "", ConductorSurface{}});
  for (const float x : {-0.99f, -0.9f, -0.5f, 0.0f, 0.9f}) {
    const Vec3 out(x, 0, std::sqrt(1 - x * x));
    const BsdfSample sample = sample_bsdf(mirror.at(out), out, 0.5f, {0.5f, 0.5f});
    EXPECT_NEAR(sample.weight.x, 1, 1e-4) << x;
    EXPECT_GT(sample.direction.z, 0) << x;
  }
}

// The normal that is seen is the interpolated one, and where that would mirror the eye into the surface, the
// nearest that does not; it never turns away, so that no silhouette goes black.
TEST(NormalTowards, IsSeenAndMirrorsAboveThePlane) {
  int bent = 0;
  for (std::uint32_t n = 0; n < 20000; ++n) {
    SurfacePoint point{{0, 0, 0}, {0, 0, 1}, 1, sample_uniform_sphere(sobol_2d(n, 1))};
    if (point.shading_normal.z < 0) point.shading_normal = -point.shading_normal;
    const Vec3 out = sample_uniform_sphere(sobol_2d(n, 2));
    if (std::abs(out.z) < 1e-3f) continue;
    const float side = out.z > 0 ? 1.0f : -1.0f;
    const Vec3 normal = point.normal_towards(out);
    ASSERT_NEAR(normal.length(), 1, 1e-5);
    ASSERT_GT(dot(normal, out), 0);
    const Vec3 image = normal * (2 * dot(normal, out)) - out;
    ASSERT_GT(image.z * side, 0);
    const Vec3 interpolated = point.shading_normal * side;
    const Vec3 mirrored = interpolated * (2 * dot(interpolated, out)) - out;
    if (mirrored.z * side > 2e-3f) {
      ASSERT_EQ(normal, interpolated);
    } else {
      ++bent;
      // At least as steep as half the angle of the plane.
      ASSERT_GE(dot(normal, out), 0.99f * std::sin(std::asin(std::abs(out.z)) / 2));
    }
  }
  EXPECT_GT(bent, 2000);
}

}  // namespace
}  // namespace nacre
