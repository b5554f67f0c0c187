// label: image
// Whole pictures whose every pixel is known: scenes in a furnace of radiance 1, seen by a camera inside it.
#include <gtest/gtest.h>

#include "nacre/bake/bake.h"
#include "nacre/geometry/primitives.h"
#include "nacre/optics/fresnel.h"
#include "nacre/optics/profile.h"
#include "nacre/render/render.h"

namespace nacre {
namespace {

constexpr float kFurnaceRadius = 200;

void add_shape(Scene& scene, const std::string& id, Mesh mesh, int surface, int medium, int light) {
  scene.shapes.push_back({id, "test", "", std::move(mesh), surface, medium, light});
}

// A sphere that shines inward with radiance 1 and reflects nothing; a camera that looks at the origin from
// `eye`.
Scene make_furnace(const Vec3& eye) {
  Scene scene;
  scene.surfaces.push_back({"black", "", DiffuseSurface{{0, 0, 0}}});
  Mesh furnace = make_sphere();
  for (Vec3& p : furnace.positions) p *= kFurnaceRadius;
  flip_normals(furnace);
  add_shape(scene, "furnace", std::move(furnace), 0, kNone, 0);
  scene.lights.push_back({"light", "", AreaLight{0, {1, 1, 1}}});

  // Mitsuba's camera space: +z forward, +x to the left, +y up.
  const Vec3 forward = (-eye).normalized();
  const Vec3 left = cross(std::abs(forward.y) > 0.9f ? Vec3(1, 0, 0) : Vec3(0, 1, 0), forward).normalized();
  const Vec3 up = cross(forward, left);
  Camera camera;
  camera.id = "camera";
  camera.fov = 1;
  for (int k = 0; k < 3; ++k) {
    camera.to_world[0][k] = left[k];
    camera.to_world[1][k] = up[k];
    camera.to_world[2][k] = forward[k];
    camera.to_world[3][k] = eye[k];
  }
  scene.cameras.push_back(camera);
  Film film;
  film.width = film.height = 8;
  film.filter = FilterKind::kBox;
  film.filter_radius = 0.5f;
  scene.films.push_back(film);
  scene.samples_per_pixel = 16;
  return scene;
}

struct Means {
  Rgb beauty{0, 0, 0}, diffusion{0, 0, 0}, specular{0, 0, 0}, surface{0, 0, 0};
};

Means render_means(const Scene& scene, int irradiance_samples, double spacing_mm) {
  const World world = make_world(scene, true);
  Progress progress;
  Report report;
  Warnings warnings;
  Cache cache;
  if (!scene.media.empty()) {
    BakeParams params;
    params.irradiance_samples = irradiance_samples;
    params.spacing_mm = spacing_mm;
    cache = bake(world, plan_bake(scene, params), params, progress, report);
  }
  RenderParams params = default_render_params(scene, 0);
  params.method = Method::kExact;  // what is tested is everything but the tolerance
  params.single_samples = 0;       // the profiles' totals are those of diffusion alone
  const Image image = render(world, cache, params, progress, report, warnings);
  const auto mean = [&](const std::string& prefix) {
    Rgb result;
    const char* const names[] = {"R", "G", "B"};
    for (int k = 0; k < 3; ++k) {
      const Channel* channel = find_channel(image, prefix + names[k]);
      double sum = 0;
      for (const float v : channel->values) sum += v;
      result[k] = static_cast<float>(sum / static_cast<double>(channel->values.size()));
    }
    return result;
  };
  return {mean(""), mean("diffusion."), mean("specular."), mean("surface.")};
}

// A flat translucent plane many decay lengths wide.
Scene make_translucent_plane(float degrees, ProfileKind profile, Convention convention) {
  const float angle = degrees * kPi / 180;
  Scene scene = make_furnace(Vec3(std::sin(angle), 0, std::cos(angle)) * 100);
  Medium medium;
  medium.id = "plane";
  medium.sigma_s = {1.0f, 1.5f, 2.0f};
  medium.sigma_a = {0.5f, 0.3f, 1.0f};
  medium.int_ior = 1.4f;
  medium.ext_ior = 1.0f;
  medium.profile = profile;
  medium.convention = convention;
  scene.media.push_back(medium);
  scene.subsurface.emplace_back();
  scene.subsurface.back().indirect = false;
  Mesh plane = make_rectangle();
  for (Vec3& p : plane.positions) p *= 6;
  add_shape(scene, "plane", std::move(plane), kNone, 0, kNone);
  return scene;
}

TEST(Furnace, TranslucentPlaneReflectsItsTotal) {
  for (const ProfileKind profile : {ProfileKind::kDipole, ProfileKind::kBetterDipole})
    for (const float degrees : {5.0f, 60.0f}) {
      const Scene scene = make_translucent_plane(degrees, profile, Convention::kConserving);
      const Means means = render_means(scene, 1024, 0.2);
      const auto profiles = make_profiles(scene.media[0]);
      const double f_r = fresnel_reflectance(std::cos(degrees * kPiD / 180), 1.4);
      for (int k = 0; k < 3; ++k) {
        const double total = profiles[static_cast<std::size_t>(k)].total;
        EXPECT_NEAR(means.specular[k], f_r, 0.005 * f_r + 1e-4);
        EXPECT_NEAR(means.diffusion[k], (1 - f_r) * total, 0.005 * (1 - f_r) * total) << degrees << " " << k;
        EXPECT_NEAR(means.beauty[k], f_r + (1 - f_r) * total, 0.005 * (f_r + (1 - f_r) * total));
        EXPECT_EQ(means.surface[k], 0);
      }
    }
}

// The same in light from all around, by an integrator of one bounce and one of many.
TEST(Furnace, TranslucentPlaneUnderAnEvenSky) {
  for (const IntegratorKind kind : {IntegratorKind::kDirect, IntegratorKind::kPath}) {
    Scene scene = make_translucent_plane(30, ProfileKind::kDipole, Convention::kConserving);
    std::erase_if(scene.shapes, [](const Shape& shape) { return shape.light != kNone; });
    scene.lights = {{"sky", "", ConstantLight{{1, 1, 1}}}};
    scene.integrator.kind = kind;
    scene.subsurface[0].indirect = true;
    const Means means = render_means(scene, 256, 0.2);
    const auto profiles = make_profiles(scene.media[0]);
    const double f_r = fresnel_reflectance(std::cos(30 * kPiD / 180), 1.4);
    for (int k = 0; k < 3; ++k) {
      const double expected = f_r + (1 - f_r) * profiles[static_cast<std::size_t>(k)].total;
      EXPECT_NEAR(means.beauty[k] / expected, 1, 0.005) << static_cast<int>(kind) << k;
    }
  }
}

TEST(Furnace, PublishedConventionLosesTheTransmittance) {
  const Means published =
      render_means(make_translucent_plane(5, ProfileKind::kDipole, Convention::kPublished), 64, 0.3);
  const Means conserving =
      render_means(make_translucent_plane(5, ProfileKind::kDipole, Convention::kConserving), 64, 0.3);
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(published.diffusion[k] / conserving.diffusion[k], mean_transmittance(1.4), 1e-5);
}

TEST(Furnace, WhiteDiffuseSphereVanishes) {
  Scene scene = make_furnace({0, 0, 50});
  scene.surfaces.push_back({"white", "", DiffuseSurface{{1, 1, 1}}});
  scene.integrator.emitter_samples = 256;
  add_shape(scene, "ball", make_sphere(), 1, kNone, kNone);
  const Means means = render_means(scene, 0, 0);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(means.surface[k], 1, 0.01);
}

// Glass sends every ray on, reflected or refracted, until it meets the furnace.
TEST(Furnace, GlassSphereVanishes) {
  Scene scene = make_furnace({0, 0, 50});
  scene.surfaces.push_back({"glass", "", DielectricSurface{}});
  add_shape(scene, "ball", make_sphere(), 1, kNone, kNone);
  const Means means = render_means(scene, 0, 0);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(means.beauty[k], 1, 0.002);
}

TEST(Furnace, PlasticNeverShinesMoreThanItReceives) {
  Scene scene = make_furnace({0, 0, 50});
  scene.surfaces.push_back({"plastic", "", PlasticSurface{1.5f, 1.0f, {1, 1, 1}, {1, 1, 1}, true}});
  scene.integrator.emitter_samples = 256;
  add_shape(scene, "ball", make_sphere(), 1, kNone, kNone);
  const Means means = render_means(scene, 0, 0);
  for (int k = 0; k < 3; ++k) {
    EXPECT_LT(means.beauty[k], 1.01);
    EXPECT_GT(means.beauty[k], 0.9);
  }
}

}  // namespace
}  // namespace nacre
