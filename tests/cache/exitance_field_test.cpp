// label: analytic
// Exitance interpolated over triangles against its evaluation at the points themselves.
#include "nacre/cache/exitance_field.h"

#include <gtest/gtest.h>

#include "cache/sample_sets.h"
#include "nacre/base/parallel.h"
#include "nacre/geometry/primitives.h"

namespace nacre {
namespace {

using namespace testing_support;

// Samples on the square [-1,1]^2 and on the unit sphere, `paths` mean free paths apart: 0.65 as bake does it.
struct Fixture {
  explicit Fixture(const SurfaceSamples& samples, double with_tolerance = 0.01, double paths = 0.65)
      : owned(make_group(samples)), tolerance(with_tolerance) {
    double area = 0;
    for (const float a : samples.areas) area += static_cast<double>(a);
    spacing = hexagonal_spacing(area, static_cast<double>(samples.size()));
    medium = make_medium(*find_preset("Marble"));
    medium.scale = static_cast<float>(paths * double{smallest_mean_free_path(medium)} / spacing);
    distance = ExitanceField::node_distance(tolerance) * spacing / paths;
    exitance = std::make_unique<const Exitance>(owned.group, medium, tolerance);
    exact = std::make_unique<const Exitance>(owned.group, medium, 0);
  }
  OwnedGroup owned;
  double tolerance;
  Medium medium;
  double spacing = 0, distance = 0;
  std::unique_ptr<const Exitance> exitance, exact;
};

std::vector<Rgb> eval(const ExitanceField& field, std::span<const Hit> hits) {
  std::vector<Rgb> values(hits.size());
  std::uint64_t evaluations = 0;
  field.eval(hits, values, evaluations);
  return values;
}

// Points all over a mesh, by triangle.
std::vector<Hit> make_hits(const Mesh& mesh, std::size_t count) {
  std::vector<Hit> hits;
  Rng rng(9);
  for (std::size_t i = 0; i < count; ++i) {
    const float root = std::sqrt(rng.next_float());
    Hit hit{.t = 1, .mesh = 0, .triangle = 0, .u = root * rng.next_float(), .v = 1 - root};
    hit.triangle = static_cast<std::uint32_t>(rng.next_bits() % mesh.triangles.size());
    hits.push_back(hit);
  }
  return hits;
}

void expect_agreement(const Fixture& fixture, const Mesh& mesh, double tolerance, const char* name) {
  const ExitanceField field({&mesh}, *fixture.exitance, fixture.distance, fixture.tolerance);
  const std::vector<Hit> hits = make_hits(mesh, 400);
  const std::vector<Rgb> values = eval(field, hits);
  double error[3]{}, norm[3]{}, brightest[3]{};
  std::vector<Rgb> exact(hits.size());
  std::uint64_t evaluations = 0;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const Vec3 x = hit_position(mesh, hits[i]);
    fixture.exact->eval({&x, 1}, {&exact[i], 1}, evaluations);
    for (int k = 0; k < 3; ++k) brightest[k] = std::max(brightest[k], double{exact[i][k]});
  }
  for (std::size_t i = 0; i < hits.size(); ++i)
    for (int k = 0; k < 3; ++k) {
      const double difference = double{values[i][k]} - double{exact[i][k]};
      error[k] += square(difference);
      norm[k] += square(double{exact[i][k]});
      EXPECT_LT(std::abs(difference), 0.05 * double{exact[i][k]} + 1e-4 * brightest[k]) << name;
    }
  for (int k = 0; k < 3; ++k)
    EXPECT_LT(std::sqrt(error[k] / norm[k]), tolerance) << name << ", tolerance " << tolerance;
  EXPECT_LT(static_cast<double>(field.node_count()),
            2 * ExitanceField::predict_nodes(std::vector<const Mesh*>{&mesh}, fixture.distance));
}

// A square of triangles of all sizes: one corner divided again and again, so that long edges border on short
// ones; with slivers.
Mesh make_graded_square() {
  Mesh mesh;
  mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  mesh.triangles = {{0, 2, 3}};
  Triangle corner{0, 1, 2};
  for (int i = 0; i < 8; ++i) {  // cut off a piece next to the corner's last edge
    const Vec3 p = mesh.positions[corner[0]] * 0.4f + mesh.positions[corner[1]] * 0.6f;
    mesh.positions.push_back(p);
    const auto middle = static_cast<std::uint32_t>(mesh.positions.size() - 1);
    mesh.triangles.push_back({corner[0], middle, corner[2]});
    corner = {middle, corner[1], corner[2]};
  }
  mesh.triangles.push_back(corner);
  return mesh;
}

TEST(ExitanceField, IsCloseToTheExactSumOnMeshesOfAllKinds) {
  for (const double tolerance : {0.01, 0.001}) {
    const Fixture plane(make_plane(90, &side_light), tolerance),
        sphere(make_sphere(90, &side_light), tolerance);
    expect_agreement(plane, make_rectangle(), tolerance, "two large triangles");
    expect_agreement(plane, make_graded_square(), tolerance, "graded");
    expect_agreement(sphere, make_sphere(), tolerance, "small triangles");
  }
}

// The largest relative difference between both sides of the edges of a mesh.
double largest_crack(const ExitanceField& field, const Mesh& mesh) {
  int compared = 0;
  double largest = 0;
  for (std::uint32_t a = 0; a < mesh.triangles.size(); ++a)
    for (std::uint32_t b = 0; b < a; ++b) {
      std::vector<std::array<std::size_t, 2>> shared;
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
          if (mesh.triangles[a][i] == mesh.triangles[b][j]) shared.push_back({i, j});
      if (shared.size() != 2) continue;
      for (int step = 0; step <= 100; ++step) {
        const auto hit_at = [&](std::uint32_t triangle, std::size_t side) {
          std::array<float, 3> weights{};
          weights[shared[0][side]] = 1 - static_cast<float>(step) / 100;
          weights[shared[1][side]] = static_cast<float>(step) / 100;
          return Hit{.t = 1, .mesh = 0, .triangle = triangle, .u = weights[1], .v = weights[2]};
        };
        const std::vector<Hit> hits{hit_at(a, 0), hit_at(b, 1)};
        const std::vector<Rgb> values = eval(field, hits);
        for (int k = 0; k < 3; ++k)
          largest = std::max(largest, std::abs(double{values[0][k]} / double{values[1][k]} - 1));
        ++compared;
      }
    }
  EXPECT_GE(compared, 9 * 101);
  return largest;
}

// Both sides of every edge give the same value there, whatever is divided how; but where one side is too
// steep to be interpolated, what the other errs by, half a percent next to the rim of a sheet.
TEST(ExitanceField, HasNoCracks) {
  const Fixture fixture(make_plane(90, &side_light), 0.01, 0.3);
  const Mesh whole = make_graded_square();
  Mesh middle = whole;
  for (Vec3& p : middle.positions) p *= 0.6f;
  EXPECT_LT(
      largest_crack(ExitanceField({&middle}, *fixture.exitance, fixture.distance, fixture.tolerance), middle),
      2e-5);
  EXPECT_LT(
      largest_crack(ExitanceField({&whole}, *fixture.exitance, fixture.distance, fixture.tolerance), whole),
      0.006);
}

// Light on one sample alone: nodes are too far apart for that, and the patches around it are not
// interpolated.
TEST(ExitanceField, ResolvesLightNarrowerThanItsNodes) {
  const Mesh mesh = make_rectangle();
  for (const float x : {0.03f, 0.31f, -0.5f}) {
    SurfaceSamples samples = make_plane(90, &uniform_light);
    for (std::size_t i = 0; i < samples.size(); ++i)
      samples.irradiance[i] *= (samples.positions[i] - Vec3(x, 0.2f, 0)).length() < 0.02f ? 1.0f : 0.0f;
    const Fixture fixture(samples);
    const ExitanceField field({&mesh}, *fixture.exitance, fixture.distance, fixture.tolerance);
    Rng rng(1);
    double error = 0, norm = 0;
    for (int i = 0; i < 500; ++i) {
      const Vec3 p(x + 0.3f * (rng.next_float() - 0.5f), 0.2f + 0.3f * (rng.next_float() - 0.5f), 0);
      // make_rectangle is (-1,-1), (1,-1), (1,1) and (-1,-1), (1,1), (-1,1), or turned.
      for (std::uint32_t triangle = 0; triangle < 2; ++triangle) {
        const Triangle& t = mesh.triangles[triangle];
        const Vec3 a = mesh.positions[t[0]], ab = mesh.positions[t[1]] - a, ac = mesh.positions[t[2]] - a;
        const float area = cross(ab, ac).z;
        const Hit hit{.t = 1,
                      .mesh = 0,
                      .triangle = triangle,
                      .u = cross(p - a, ac).z / area,
                      .v = cross(ab, p - a).z / area};
        if (hit.u < 0 || hit.v < 0 || hit.u + hit.v > 1) continue;
        const Rgb value = eval(field, {&hit, 1})[0];
        Rgb exact;
        std::uint64_t evaluations = 0;
        fixture.exact->eval({&p, 1}, {&exact, 1}, evaluations);
        error += square(double{value.x} - double{exact.x});
        norm += square(double{exact.x});
      }
    }
    EXPECT_GT(norm, 0);
    EXPECT_LT(std::sqrt(error / norm), 0.01) << x;
  }
}

TEST(ExitanceField, DependsNeitherOnOrderNorOnThreads) {
  const Fixture fixture(make_plane(60, &side_light));
  const Mesh mesh = make_graded_square();
  const std::vector<Hit> hits = make_hits(mesh, 3000);
  const std::vector<Rgb> once =
      eval(ExitanceField({&mesh}, *fixture.exitance, fixture.distance, fixture.tolerance), hits);
  const ExitanceField field({&mesh}, *fixture.exitance, fixture.distance, fixture.tolerance);
  std::vector<Rgb> together(hits.size());
  parallel_for(hits.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const std::size_t i = hits.size() - 1 - n;
      std::uint64_t evaluations = 0;
      field.eval({&hits[i], 1}, {&together[i], 1}, evaluations);
    }
  });
  EXPECT_EQ(once, together);
}

// Some materials of a family may have to be evaluated where others are interpolated: of each the same bits
// as without the others.
TEST(ExitanceField, DependsOnNoOtherMaterial) {
  const Mesh mesh = make_graded_square();
  const Fixture fixture(make_plane(
      80, +[](const Vec3& p, const Vec3&) { return Rgb(p.x > 0.1f ? 1.0f : 0.0f); }));
  MaterialFamily family;
  for (const float absorption : {1.0f, 300.0f, 3.0f, 30.0f, 0.1f}) {
    family.media.push_back(fixture.medium);
    family.media.back().sigma_a *= absorption;
  }
  const std::size_t count = family.media.size();
  const std::vector<Hit> hits = make_hits(mesh, 3000);
  std::uint64_t evaluations = 0;
  std::vector<std::vector<Rgb>> alone;
  std::vector<std::uint64_t> costs;
  for (std::uint32_t m = 0; m < count; ++m) {
    family.wanted = {m};
    const Exitance exitance(fixture.owned.group, family, fixture.tolerance);
    const ExitanceField field({&mesh}, exitance, fixture.distance, fixture.tolerance);
    alone.emplace_back(hits.size());
    std::uint64_t own = 0;
    field.eval(hits, alone.back(), own);
    costs.push_back(own);
  }
  // Else no patch would be steep for some of them only.
  EXPECT_NE(std::ranges::min(costs), std::ranges::max(costs));
  for (const std::vector<std::uint32_t>& wanted :
       {std::vector<std::uint32_t>{0, 1, 2, 3, 4}, std::vector<std::uint32_t>{3, 0},
        std::vector<std::uint32_t>{1, 4, 2}}) {
    family.wanted = wanted;
    const Exitance exitance(fixture.owned.group, family, fixture.tolerance);
    const ExitanceField field({&mesh}, exitance, fixture.distance, fixture.tolerance);
    std::vector<Rgb> values(hits.size() * wanted.size());
    for (int run = 0; run < 2; ++run) {  // at first sight, and known
      field.eval(hits, values, evaluations);
      for (std::size_t i = 0; i < hits.size(); ++i)
        for (std::size_t m = 0; m < wanted.size(); ++m)
          ASSERT_EQ(values[i * wanted.size() + m], alone[wanted[m]][i]) << i << " " << wanted[m];
    }
  }
}

TEST(ExitanceField, EvaluatesEachNodeOnce) {
  const Fixture fixture(make_plane(90, &side_light), 0.01, 0.3);
  const Mesh mesh = [] {
    Mesh middle = make_rectangle();  // away from the rim, which is steep
    for (Vec3& p : middle.positions) p *= 0.6f;
    return middle;
  }();
  const ExitanceField field({&mesh}, *fixture.exitance, fixture.distance, fixture.tolerance);
  const std::vector<Hit> hits = make_hits(mesh, 5000);
  std::vector<Rgb> values(hits.size());
  std::uint64_t first = 0, second = 0;
  field.eval(hits, values, first);
  field.eval(hits, values, second);
  EXPECT_GT(first, field.node_count());
  EXPECT_EQ(second, 0u);
}

// Meshes of another medium have no part in it; degenerate triangles do no harm.
TEST(ExitanceField, TakesOddMeshes) {
  const Fixture fixture(make_plane(40, &side_light));
  Mesh mesh = make_rectangle();
  mesh.triangles.push_back({0, 0, 1});
  mesh.triangles.push_back({2, 2, 2});
  const ExitanceField field({nullptr, &mesh}, *fixture.exitance, fixture.distance, fixture.tolerance);
  for (std::uint32_t triangle = 0; triangle < mesh.triangles.size(); ++triangle) {
    const Hit hit{.t = 1, .mesh = 1, .triangle = triangle, .u = 0.3f, .v = 0.3f};
    const Rgb value = eval(field, {&hit, 1})[0];
    for (int k = 0; k < 3; ++k) EXPECT_TRUE(std::isfinite(value[k]) && value[k] > 0) << triangle;
  }
}

}  // namespace
}  // namespace nacre
