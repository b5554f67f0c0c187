// label: analytic
// Single scattering against closed forms of the half-space, and against quadrature that shares nothing with
// the renderer: double precision, every triangle tested, a sphere by its equation.
#include <functional>

#include "nacre/optics/fresnel.h"
#include "render/single_scattering_parts.h"

namespace nacre {
namespace {

using namespace testing_support;

double henyey_greenstein(double cosine, double g) {
  return (1 - g * g) / (4 * kPiD * std::pow(1 + g * g - 2 * g * cosine, 1.5));
}
double fresnel_transmittance(double cosine, double eta) {
  const double cos_t = std::sqrt(1 - (1 - cosine * cosine) / (eta * eta));
  const double r_s = (cosine - eta * cos_t) / (cosine + eta * cos_t);
  const double r_p = (eta * cosine - cos_t) / (eta * cosine + cos_t);
  return 1 - (r_s * r_s + r_p * r_p) / 2;
}
Vec3d direction_at(double degrees, double azimuth) {
  const double theta = degrees * kPiD / 180, phi = azimuth * kPiD / 180;
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

TEST(HalfSpace, BothConventionsMeetTheirClosedForms) {
  // A box so large that only its top counts.
  const double angles[5][3] = {{0, 0, 0}, {30, 30, 180}, {60, 20, 90}, {10, 75, 45}, {80, 80, 170}};
  for (const float g : {-0.3f, 0.0f, 0.6f})
    for (const Convention convention : {Convention::kPublished, Convention::kConserving})
      for (const auto& [in_degrees, out_degrees, azimuth] : angles) {
        Scene scene;
        Medium medium = make_test_medium();
        medium.g = {g, g, g};
        medium.convention = convention;
        add_shape(scene, placed(make_cube(), Vec3(1000, 1000, 1000), {0, 0, -1000}), kNone,
                  add_medium(scene, medium));
        const Vec3d in = direction_at(in_degrees, 0), out = direction_at(out_degrees, azimuth);
        const Rgb irradiance(2, 3, 5);
        add_directional_light(scene, Vec3(-in), irradiance);
        const World world = make_world(scene, true);
        const SingleScattering single(world, 0, world.scene->media[0]);
        const SurfacePoint point = point_at(world, Vec3(0.3f, 0.2f, 1), {0, 0, -1});
        const Estimate estimate = estimate_many(single, point, Vec3(out), 64, 1024);

        const double eta = static_cast<double>(medium.eta());
        const double cos_i = in.z, cos_o = out.z;
        const double ci = std::sqrt(1 - (1 - cos_i * cos_i) / square(eta));
        const double co = std::sqrt(1 - (1 - cos_o * cos_o) / square(eta));
        // Refracted directions, both pointing up: sines shrink by eta.
        const Vec3d in_inside(in.x / eta, in.y / eta, ci), out_inside(out.x / eta, out.y / eta, co);
        const double fresnel = fresnel_transmittance(cos_i, eta) * fresnel_transmittance(cos_o, eta);
        const double phase = henyey_greenstein(-in_inside.dot(out_inside), static_cast<double>(g));
        const double side = convention == Convention::kPublished ? ci : cos_i / square(eta);
        for (int k = 0; k < 3; ++k) {
          const double alpha =
              static_cast<double>(medium.sigma_s[k]) /
              (static_cast<double>(medium.sigma_s[k]) + static_cast<double>(medium.sigma_a[k]));
          const double expected =
              alpha * fresnel * phase * static_cast<double>(irradiance[k]) * side / (ci + co);
          EXPECT_NEAR(static_cast<double>(estimate.mean[k]) / expected, 1, 0.005)
              << "g " << g << " angles " << in_degrees << " " << out_degrees << " channel " << k;
        }
      }
}

// Materials that share points and connections are each what they are alone, thin or dense, whatever their
// phase.
TEST(HalfSpace, MembersOfAFamilyAreAsAlone) {
  Scene scene;
  Medium medium = make_test_medium();
  add_shape(scene, placed(make_cube(), Vec3(1000, 1000, 1000), {0, 0, -1000}), kNone,
            add_medium(scene, medium));
  add_directional_light(scene, Vec3(-direction_at(20, 30)), {2, 3, 5});
  const World world = make_world(scene, true);
  const SurfacePoint point = point_at(world, Vec3(0.3f, 0.2f, 1), {0, 0, -1});
  const Vec3 out(direction_at(50, 200));
  MaterialFamily family;
  for (const float density : {0.25f, 1.0f, 1.5f, 4.0f}) {
    family.media.push_back(medium);
    family.media.back().sigma_s *= density;
    family.media.back().sigma_a *= 2 - std::sqrt(density) / 2;
    family.media.back().g = Rgb(0.2f * density - 0.3f);
  }
  family.wanted = {2, 0, 3};
  const SingleScattering together(world, 0, family);
  std::vector<Vec3d> sums(3, Vec3d(0.0));
  std::vector<Rgb> radiance(3);
  LostSamples lost;
  constexpr int kGroups = 64, kSamples = 1024;
  for (int i = 0; i < kGroups; ++i) {
    together.estimate(point, out, kSamples, hash_words(7, static_cast<std::uint64_t>(i)), 0, lost, radiance);
    for (std::size_t j = 0; j < 3; ++j) sums[j] += Vec3d(radiance[j]);
  }
  for (std::size_t j = 0; j < 3; ++j) {
    const SingleScattering alone(world, 0, family.media[family.wanted[j]]);
    const Estimate estimate = estimate_many(alone, point, out, kGroups, kSamples);
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(sums[j][k] / kGroups / double{estimate.mean[k]}, 1, 0.005) << j << " " << k;
  }
}

// A body as the reference integrators see it: where a line meets its boundary, and the normals there.
struct Boundary {
  double t;
  Vec3d normal;  // outward
};
using Body = std::function<std::vector<Boundary>(const Vec3d& origin, const Vec3d& direction)>;

// Integral along the refracted ray by the midpoint rule, of the published or conserving form, for a light at
// a point or, with `light` a unit vector and `infinite`, from a direction.
Vec3d integrate(const Body& body, const Medium& medium, const Vec3d& x, const Vec3d& normal, const Vec3d& out,
                const Vec3d& light, bool infinite, const Vec3d& emission) {
  const double eta = static_cast<double>(medium.eta());
  const double cos_o = normal.dot(out);
  const double cos_inside = std::sqrt(1 - (1 - cos_o * cos_o) / square(eta));
  const Vec3d inward = normal * (cos_o / eta - cos_inside) - out / eta;
  double length = 1e300;
  for (const Boundary& b : body(x, inward))
    if (b.t > 1e-9) length = std::min(length, b.t);

  constexpr int kSteps = 20000;
  Vec3d sum(0, 0, 0);
  for (int step = 0; step < kSteps; ++step) {
    const double s = length * (step + 0.5) / kSteps;
    const Vec3d p = x + inward * s;
    const Vec3d to = infinite ? light : (light - p).normalized();
    const double distance = infinite ? 1e300 : (light - p).length();
    std::vector<Boundary> ahead;
    for (const Boundary& b : body(p, to))
      if (b.t > 0 && b.t < distance) ahead.push_back(b);
    std::sort(ahead.begin(), ahead.end(), [](const Boundary& a, const Boundary& b) { return a.t < b.t; });
    // Inside, outside, inside, ...: the light passes each boundary, pieces inside attenuate.
    double optical = 0, transmittance = 1, entered = 0;
    Vec3d inside_direction = to;
    double conserving = 1;
    for (std::size_t i = 0; i < ahead.size(); ++i) {
      const bool leaving = i % 2 == 0;
      const double cosine = std::abs(to.dot(ahead[i].normal));
      const double refracted = std::sqrt(1 - (1 - cosine * cosine) / square(eta));
      transmittance *= fresnel_transmittance(cosine, eta);
      if (!leaving) {
        entered = ahead[i].t;
        continue;
      }
      optical += (ahead[i].t - entered) * cosine / refracted;
      if (i > 0) continue;
      const Vec3d n = to.dot(ahead[i].normal) > 0 ? ahead[i].normal : -ahead[i].normal;
      inside_direction = n * (refracted - cosine / eta) + to / eta;
      conserving = cosine / (square(eta) * refracted);
    }
    if (medium.convention == Convention::kConserving) transmittance *= conserving;
    for (int k = 0; k < 3; ++k) {
      const double sigma_s = static_cast<double>(medium.sigma_s[k] * medium.scale);
      const double sigma_t = sigma_s + static_cast<double>(medium.sigma_a[k] * medium.scale);
      sum[k] += sigma_s * std::exp(-sigma_t * (s + optical)) * transmittance *
                henyey_greenstein(inside_direction.dot(inward), static_cast<double>(medium.g[k])) *
                emission[k] / (infinite ? 1 : square(distance));
    }
  }
  return sum * (fresnel_transmittance(cos_o, eta) * length / kSteps);
}

void expect_agreement(const Estimate& estimate, const Vec3d& expected, double tolerance,
                      const std::string& what) {
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(static_cast<double>(estimate.mean[k]) / expected[k], 1,
                tolerance + 4 * static_cast<double>(estimate.error[k]) / expected[k])
        << what << " channel " << k;
    EXPECT_LT(static_cast<double>(estimate.error[k]), 0.003 * expected[k]) << what;
  }
}

TEST(Sphere, MeetsQuadrature) {
  constexpr double kRadius = 4;
  const Body body = [](const Vec3d& origin, const Vec3d& direction) {
    const double b = origin.dot(direction), c = origin.length2() - square(kRadius);
    const double root = std::sqrt(std::max(b * b - c, 0.0));
    std::vector<Boundary> result;
    for (const double t : {-b - root, -b + root}) result.push_back({t, (origin + direction * t) / kRadius});
    return result;
  };
  for (const Convention convention : {Convention::kPublished, Convention::kConserving}) {
    Scene scene;
    Medium medium = make_test_medium();
    medium.convention = convention;
    medium.g = {-0.3f, 0.0f, 0.6f};
    medium.scale = 0.5f;
    add_shape(scene, placed(make_sphere(), static_cast<float>(kRadius), {0, 0, 0}), kNone,
              add_medium(scene, medium));
    const Vec3d light(3, 9, 6), emission(100, 200, 300);
    add_point_light(scene, Vec3(light), Rgb(Vec3(emission)));
    const World world = make_world(scene, true);
    const SingleScattering single(world, 0, world.scene->media[0]);
    // From the lit side to the unlit one.
    for (const Vec3d& eye : {Vec3d(2, 8, 3), Vec3d(10, 1, 2), Vec3d(-3, -2, 9), Vec3d(-2, -9, -3)}) {
      const Vec3d out = eye.normalized();
      const Vec3d x = (out + Vec3d(0.2, 0.1, -0.1)).normalized() * kRadius;
      const SurfacePoint point = point_at(world, Vec3(x * 2), Vec3(-x.normalized()));
      const Vec3d expected = integrate(body, medium, x, x.normalized(), out, light, false, emission);
      expect_agreement(estimate_many(single, point, Vec3(out), 64, 1024), expected, 0.005,
                       fmt::format("eye {} {} {}", eye.x, eye.y, eye.z));
    }
  }
}

// The prism over a U-shaped outline: two towers of height 6 on a common base.
Mesh make_u_shape() {
  const Vec2 outline[] = {{0, 0}, {7, 0}, {7, 6}, {5, 6}, {5, 2}, {2, 2}, {2, 6}, {0, 6}};
  const int caps[][3] = {{0, 1, 4}, {0, 4, 5}, {1, 2, 3}, {1, 3, 4}, {0, 5, 6}, {0, 6, 7}};
  Mesh mesh;
  for (const float z : {-2.0f, 2.0f})
    for (const Vec2& p : outline) mesh.positions.push_back({p.x, p.y, z});
  for (const auto& cap : caps) {
    const auto a = static_cast<std::uint32_t>(cap[0]), b = static_cast<std::uint32_t>(cap[1]),
               c = static_cast<std::uint32_t>(cap[2]);
    mesh.triangles.push_back({c, b, a});
    mesh.triangles.push_back({a + 8, b + 8, c + 8});
  }
  for (std::uint32_t i = 0; i < 8; ++i) {
    const std::uint32_t j = (i + 1) % 8;
    mesh.triangles.push_back({i, j, j + 8});
    mesh.triangles.push_back({i, j + 8, i + 8});
  }
  return mesh;
}

// Every triangle of a mesh, by Moeller and Trumbore's test in double precision.
Body make_body(const Mesh& mesh) {
  return [&mesh](const Vec3d& origin, const Vec3d& direction) {
    std::vector<Boundary> result;
    for (const Triangle& t : mesh.triangles) {
      const Vec3d a(mesh.positions[t[0]]), e1 = Vec3d(mesh.positions[t[1]]) - a,
                                           e2 = Vec3d(mesh.positions[t[2]]) - a;
      const Vec3d p = direction.cross(e2), s = origin - a, q = s.cross(e1);
      const double determinant = e1.dot(p), u = s.dot(p) / determinant, v = direction.dot(q) / determinant;
      if (determinant != 0 && u >= 0 && v >= 0 && u + v <= 1)
        result.push_back({e2.dot(q) / determinant, e1.cross(e2).normalized()});
    }
    return result;
  };
}

TEST(ConcaveBody, MeetsQuadratureThroughSeveralEntriesAndExits) {
  const Mesh mesh = make_u_shape();
  EXPECT_NEAR(signed_volume(mesh), 30 * 4, 1e-4);
  for (const Convention convention : {Convention::kPublished, Convention::kConserving}) {
    Scene scene;
    Medium medium = make_test_medium();
    medium.convention = convention;
    medium.g = {-0.3f, 0.0f, 0.6f};
    medium.scale = 0.3f;
    add_shape(scene, mesh, kNone, add_medium(scene, medium));
    // Low from the right: through the right tower, the gap, and into the left one.
    const Vec3d light = Vec3d(1, 0.137, 0.071).normalized(), emission(4, 5, 6);
    add_directional_light(scene, Vec3(-light), Rgb(Vec3(emission)));
    const World world = make_world(scene, true);
    const SingleScattering single(world, 0, world.scene->media[0]);
    struct View {
      Vec3d x, normal, out;
    };
    for (const View& view :
         {View{{0.9, 4.1, 2}, {0, 0, 1}, {0.3, 0.2, 0.8}}, View{{0, 3.3, 0.4}, {-1, 0, 0}, {-0.9, 0.3, -0.2}},
          View{{3.3, 2, 0.3}, {0, 1, 0}, {0.2, 0.9, 0.5}}}) {
      const Vec3d out = view.out.normalized();
      const SurfacePoint point = point_at(world, Vec3(view.x + view.normal * 0.5), Vec3(-view.normal));
      const Vec3d expected =
          integrate(make_body(mesh), medium, view.x, view.normal, out, light, true, emission);
      expect_agreement(estimate_many(single, point, Vec3(out), 64, 256), expected, 0.005,
                       fmt::format("x {} {} {}", view.x.x, view.x.y, view.x.z));
    }
  }
}

// Bodies of one medium that overlap or touch are one, whichever comes first and wherever their faces lie upon
// each other.
TEST(OverlappingBodies, AttenuateAsTheirUnion) {
  using Boxes = std::vector<std::array<Vec3, 2>>;  // low and high corners
  const auto estimate = [](const Boxes& boxes) {
    Scene scene;
    const int medium = add_medium(scene, make_test_medium());
    for (const auto& [low, high] : boxes)
      add_shape(scene, placed(make_cube(), (high - low) * 0.5f, (high + low) * 0.5f), kNone, medium);
    add_directional_light(scene, {0.3f, -0.2f, 1}, {1, 1, 1});
    add_directional_light(scene, {0.9f, 0.2f, -0.3f}, {1, 1, 1});
    const World world = make_world(scene, true);
    const SingleScattering single(world, 0, world.scene->media[0]);
    return estimate_many(single, point_at(world, {0.3f, 0.2f, 9}, {0, 0, -1}), {0, 0, 1}, 16, 256);
  };
  const Estimate whole = estimate({{Vec3(-2, -2, -3), Vec3(2, 2, 4)}});
  const std::pair<const char*, Boxes> splits[] = {
      {"overlapping", {{Vec3(-2, -2, -2), Vec3(2, 2, 4)}, {Vec3(-2, -2, -3), Vec3(2, 2, 1)}}},
      {"touching below", {{Vec3(-2, -2, -3), Vec3(2, 2, 3.5f)}, {Vec3(-2, -2, 3.5f), Vec3(2, 2, 4)}}},
      {"touching beside", {{Vec3(0, -2, -3), Vec3(2, 2, 4)}, {Vec3(-2, -2, -3), Vec3(0, 2, 4)}}},
      {"tops in one plane", {{Vec3(-1, -2, -3), Vec3(2, 2, 4)}, {Vec3(-2, -2, -3), Vec3(1, 2, 4)}}},
      {"one twice", {{Vec3(-2, -2, -3), Vec3(2, 2, 4)}, {Vec3(-2, -2, -3), Vec3(2, 2, 4)}}}};
  for (const auto& [name, boxes] : splits) {
    const Estimate split = estimate(boxes);
    for (int k = 0; k < 3; ++k) {
      EXPECT_GT(whole.mean[k], 0);
      EXPECT_NEAR(split.mean[k] / whole.mean[k], 1, 1e-3) << name << " " << k;
    }
  }
}

// A sheet without thickness stands for the half-space behind it.
TEST(FlatSheet, IsAHalfSpace) {
  const auto estimate = [](Mesh mesh) {
    Scene scene;
    add_shape(scene, std::move(mesh), kNone, add_medium(scene, make_test_medium()));
    add_directional_light(scene, {0.3f, -0.2f, -1}, {1, 1, 1});
    const World world = make_world(scene, true);
    LostSamples lost;
    return SingleScattering(world, 0, world.scene->media[0])
        .estimate(point_at(world, {0.3f, 0.2f, 9}, {0, 0, -1}), Vec3(0.5f, 0, 1).normalized(), 4096, 1, 0,
                  lost);
  };
  const Rgb sheet = estimate(placed(make_rectangle(), 100, {0, 0, 0}));
  const Rgb block = estimate(placed(make_cube(), 100, {0, 0, -100}));
  for (int k = 0; k < 3; ++k) {
    EXPECT_GT(block[k], 0);
    EXPECT_NEAR(sheet[k] / block[k], 1, 1e-3);
  }
}

}  // namespace
}  // namespace nacre
