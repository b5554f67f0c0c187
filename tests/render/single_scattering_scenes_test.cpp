// label: analytic
// Single scattering on what scenes are made of: other objects, open and coarse meshes, extreme coefficients.
#include "render/single_scattering_parts.h"

namespace nacre {
namespace {

using namespace testing_support;

// A sphere of few facets with the normals of the round one.
Mesh make_coarse_sphere(int rings, int segments) {
  Mesh mesh;
  for (int i = 0; i <= rings; ++i)
    for (int j = 0; j <= segments; ++j) {
      const float theta = kPi * static_cast<float>(i) / static_cast<float>(rings);
      const float phi = 2 * kPi * static_cast<float>(j) / static_cast<float>(segments);
      mesh.positions.push_back(
          {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)});
    }
  mesh.normals = mesh.positions;
  const auto index = [&](int i, int j) { return static_cast<std::uint32_t>(i * (segments + 1) + j); };
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < segments; ++j) {
      if (i > 0) mesh.triangles.push_back({index(i, j), index(i + 1, j), index(i, j + 1)});
      if (i + 1 < rings) mesh.triangles.push_back({index(i, j + 1), index(i + 1, j), index(i + 1, j + 1)});
    }
  return mesh;
}

// Few facets, far wider than a mean free path, and smooth normals look like the round sphere: neither facets
// nor jumps at their edges, from lights in front and from the side.
TEST(CoarseMesh, LooksAsSmoothAsItsNormals) {
  for (const float scale : {20.0f, 2.0f})
    for (const Vec3& light : {Vec3(-0.9f, 0, -0.5f), Vec3(0.3f, 0.2f, -1)}) {
      const auto row = [&](Mesh mesh) {
        Scene scene;
        Medium medium = make_test_medium();
        medium.scale = scale;
        add_shape(scene, std::move(mesh), kNone, add_medium(scene, medium));
        add_directional_light(scene, light, {1, 1, 1});
        const World world = make_world(scene, true);
        const SingleScattering single(world, 0, world.scene->media[0]);
        std::vector<double> values;
        LostSamples lost;
        for (int i = 0; i < 200; ++i) {
          const float azimuth = (-75 + 150 * static_cast<float>(i) / 199) * kPi / 180;
          const Vec3 from(std::sin(azimuth), 0.2f, std::cos(azimuth));
          if (-dot(light.normalized(), from) < 0.3f) continue;  // the dark side and where it begins
          values.push_back(
              double{single.estimate(point_at(world, from * 3.0f, -from), {0, 0, 1}, 4096, 3, 0, lost).y});
        }
        return values;
      };
      const std::vector<double> round = row(make_sphere()), coarse = row(make_coarse_sphere(8, 12));
      ASSERT_EQ(round.size(), coarse.size());
      ASSERT_GT(round.size(), 100u);
      for (std::size_t i = 0; i < round.size(); ++i) {
        EXPECT_NEAR(coarse[i] / round[i], 1, 0.1) << "scale " << scale << " point " << i;
        if (i == 0) continue;
        EXPECT_NEAR(coarse[i] / coarse[i - 1], round[i] / round[i - 1], 0.02)
            << "scale " << scale << " point " << i;
      }
    }
}

// Normals that go round the edges of a plate, as a mesh without any gets them, make no ball of it: light from
// behind passes its real thickness.
TEST(CoarseMesh, StaysAsThinAsItIs) {
  const auto mean = [](bool smooth) {
    Scene scene;
    Medium medium = make_test_medium();
    medium.scale = 5;
    Mesh plate = placed(make_cube(), {1, 1, 0.1f}, {0, 0, 0});
    if (smooth) {
      compute_normals(plate, 180);
      EXPECT_LT(plate.normals[0].z, 0.9f);
    }
    add_shape(scene, std::move(plate), kNone, add_medium(scene, medium));
    add_directional_light(scene, {0.1f, 0.2f, 1}, {1, 1, 1});
    const World world = make_world(scene, true);
    const SingleScattering single(world, 0, world.scene->media[0]);
    LostSamples lost;
    double sum = 0;
    for (std::uint32_t i = 0; i < 256; ++i) {
      const Vec2 u = sobol_2d(i, 1);
      const SurfacePoint point = point_at(world, {1.6f * u.x - 0.8f, 1.6f * u.y - 0.8f, 3}, {0, 0, -1});
      sum += double{single.estimate(point, {0, 0, 1}, 64, 2, 0, lost).x} / 256;
    }
    return sum;
  };
  EXPECT_NEAR(mean(true) / mean(false), 1, 0.2);
}

TEST(OtherObjects, CastFullShadowsUnlessShadowsAreOff) {
  Scene scene;
  add_shape(scene, placed(make_sphere(), 4, {0, 0, 0}), kNone, add_medium(scene, make_test_medium()));
  add_directional_light(scene, {0, 0, -1}, {1, 1, 1});
  const auto estimate = [&](bool shadows) {
    const World world = make_world(scene, shadows);
    const SingleScattering single(world, 0, world.scene->media[0]);
    return estimate_many(single, point_at(world, {0, 0, 5}, {0, 0, -1}), Vec3(1, 0, 1).normalized(), 8, 64)
        .mean;
  };
  const Rgb free = estimate(true);
  EXPECT_GT(min_channel(free), 0);
  add_shape(scene, placed(make_rectangle(), 10, {0, 0, 8}));
  EXPECT_TRUE(is_black(estimate(true)));
  EXPECT_EQ(estimate(false), free);
  // An opaque body inside blocks as well.
  scene.shapes.pop_back();
  add_shape(scene, placed(make_sphere(), 3.9f, {0, 0, 0}));
  const Rgb shell = estimate(true);
  for (int k = 0; k < 3; ++k) {
    EXPECT_GT(shell[k], 0);
    EXPECT_LT(shell[k], 0.9f * free[k]);
  }
}

// With its base taken away the bounding box closes the object where the base was: the same light, but for
// what the box does not know.
TEST(OpenMesh, EndsAtItsBoundingBox) {
  const auto estimate = [](bool open, std::uint64_t& lost_count) {
    Scene scene;
    Mesh cube = placed(make_cube(), 2, {0, 0, 0});
    if (open)
      std::erase_if(cube.triangles, [&](const Triangle& t) {
        return cross(cube.positions[t[1]] - cube.positions[t[0]], cube.positions[t[2]] - cube.positions[t[0]])
                   .z < 0;
      });
    add_shape(scene, std::move(cube), kNone, add_medium(scene, make_test_medium()));
    add_directional_light(scene, {0.2f, 0.1f, 1}, {1, 1, 1});  // from below
    const World world = make_world(scene, true);
    const SingleScattering single(world, 0, world.scene->media[0]);
    LostSamples lost;
    const Rgb value =
        single.estimate(point_at(world, {0.3f, 0.2f, 5}, {0, 0, -1}), {0, 0, 1}, 4096, 1, 0, lost);
    EXPECT_EQ(lost.taken, 4096u + 1);
    lost_count = lost.lost;
    return value;
  };
  std::uint64_t closed_lost = 0, open_lost = 0;
  const Rgb closed = estimate(false, closed_lost), open = estimate(true, open_lost);
  EXPECT_EQ(closed_lost, 0u);
  EXPECT_EQ(open_lost, 4096u + 1);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(open[k] / closed[k], 1, 1e-3);
}

TEST(Sampling, WellDistributedPointsBeatIndependentOnes) {
  Scene scene;
  add_shape(scene, placed(make_sphere(), 4, {0, 0, 0}), kNone, add_medium(scene, make_test_medium()));
  add_area_light(scene, flipped(placed(make_rectangle(), 3, {1, 2, 9})), {10, 10, 10});
  const World world = make_world(scene, true);
  const SingleScattering single(world, 0, world.scene->media[0]);
  const SurfacePoint point = point_at(world, {1, 0.5f, 6}, {0, 0, -1});
  const Vec3 out = Vec3(0.3f, 0.2f, 1).normalized();
  // Variance of the mean of n samples: one sequence, or a new scramble for each.
  const auto variance = [&](int n, bool independent) {
    constexpr int kTrials = 400;
    double sum = 0, squares = 0;
    LostSamples lost;
    for (int trial = 0; trial < kTrials; ++trial) {
      double value = 0;
      for (int i = 0; i < n; ++i) {
        const auto t = static_cast<std::uint64_t>(trial), s = static_cast<std::uint64_t>(i);
        value += double{single
                            .estimate(point, out, 1, hash_words(t, independent ? s : 0),
                                      independent ? 0u : static_cast<std::uint32_t>(i), lost)
                            .y} /
                 n;
      }
      sum += value;
      squares += value * value;
    }
    return squares / kTrials - square(sum / kTrials);
  };
  const double independent_4 = variance(4, true), independent_64 = variance(64, true);
  const double even_4 = variance(4, false), even_64 = variance(64, false);
  RecordProperty("variance",
                 fmt::format("{:.3g} {:.3g} independent, {:.3g} {:.3g} Owen-scrambled Sobol (4, 64)",
                             independent_4, independent_64, even_4, even_64));
  fmt::print("variance at 4 and 64 samples: independent {:.3g} {:.3g}, Owen-scrambled Sobol {:.3g} {:.3g}\n",
             independent_4, independent_64, even_4, even_64);
  EXPECT_NEAR(independent_4 / independent_64, 16, 5);  // 1/N
  EXPECT_GT(even_4 / even_64, 32);                     // faster than 1/N
  EXPECT_LT(even_64, independent_64 / 8);
}

TEST(Extremes, GiveFiniteRadiance) {
  for (const float sigma : {0.0f, 1e-12f, 1e-3f, 1e3f, 1e6f})
    for (const float scale : {1e-6f, 1.0f, 1e6f}) {
      Scene scene;
      Medium medium = make_test_medium();
      medium.sigma_s = {sigma, 1.0f, 0.0f};
      medium.sigma_a = {sigma, 0.0f, sigma};
      medium.g = {0.999f, -0.999f, 0};
      medium.scale = scale;
      add_shape(scene, placed(make_sphere(), 4, {1e3f, 0, 0}), kNone, add_medium(scene, medium));
      add_point_light(scene, {1e3f, 0, 0}, {1, 1, 1});  // inside
      add_point_light(scene, {1e3f, 4, 0}, {1, 1, 1});  // on the surface
      add_directional_light(scene, {0, 0, 1}, {1, 1, 1});
      const World world = make_world(scene, true);
      const SingleScattering single(world, 0, world.scene->media[0]);
      LostSamples lost;
      for (int i = 0; i < 200; ++i) {
        const Vec3 from = sample_uniform_sphere(sobol_2d(static_cast<std::uint32_t>(i), 3));
        const SurfacePoint point = point_at(world, Vec3(1e3f, 0, 0) + from * 8.0f, -from);
        Vec3 out = sample_uniform_sphere(sobol_2d(static_cast<std::uint32_t>(i), 4));
        out *= dot(out, point.geometric_normal) < 0 ? -1.0f : 1.0f;
        const Rgb value = single.estimate(point, out, 4, 5, 0, lost);
        for (int k = 0; k < 3; ++k) ASSERT_TRUE(std::isfinite(value[k]) && value[k] >= 0) << value[k];
      }
    }
}

}  // namespace
}  // namespace nacre
