// label: analytic
// The hierarchical sum against the sum over every sample, and that against closed forms.
#include "nacre/cache/exitance.h"

#include <gtest/gtest.h>

#include "cache/sample_sets.h"
#include "nacre/base/error.h"

namespace nacre {
namespace {

using namespace testing_support;

constexpr ProfileKind kKinds[] = {ProfileKind::kDipole, ProfileKind::kBetterDipole, ProfileKind::kNormalized};

std::vector<Rgb> eval(const Exitance& exitance, std::span<const Vec3> points, std::uint64_t& evaluations) {
  std::vector<Rgb> values(points.size());
  exitance.eval(points, values, evaluations);
  return values;
}

Rgb eval(const Exitance& exitance, const Vec3& x) {
  std::uint64_t evaluations = 0;
  return eval(exitance, {&x, 1}, evaluations)[0];
}

// The sum that M_o is, in double precision from the closed forms.
std::array<double, 3> reference(const SurfaceSamples& samples, const Medium& medium, const Vec3& x) {
  double area = 0;
  for (const float a : samples.areas) area += double{a};
  const auto profiles =
      resolved_profiles(medium, hexagonal_spacing(area, static_cast<double>(samples.size())));
  std::array<double, 3> sum{};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double r = (Vec3d(x) - Vec3d(samples.positions[i])).length();
    for (std::size_t k = 0; k < 3; ++k)
      sum[k] += eval_profile(profiles[k], r) * double{samples.areas[i]} *
                double{samples.irradiance[i][static_cast<int>(k)]};
  }
  return sum;
}

struct Shape {
  const char* name;
  SurfaceSamples (*make)(int, const Light&);
  int n;
  Vec3 (*point)(Rng&);
};
Vec3 on_plane(Rng& rng) { return {2 * rng.next_float() - 1, 2 * rng.next_float() - 1, 0}; }
Vec3 on_sheets(Rng& rng) { return on_plane(rng) + Vec3(0, 0, rng.next_float() < 0.5f ? 0.025f : -0.025f); }
Vec3 on_sphere(Rng& rng) {
  const float z = 2 * rng.next_float() - 1, phi = 2 * kPi * rng.next_float(), s = std::sqrt(1 - z * z);
  return {s * std::cos(phi), s * std::sin(phi), z};
}
const Shape kShapes[] = {{"plane", &make_plane, 90, &on_plane},
                         {"sheets", &make_two_sheets, 64, &on_sheets},
                         {"sphere", &make_sphere, 64, &on_sphere}};

struct Lighting {
  const char* name;
  Rgb (*light)(const Vec3&, const Vec3&);
};
const Lighting kLightings[] = {
    {"uniform", &uniform_light}, {"side", &side_light}, {"coloured", &coloured_light}, {"spot", &spot_light}};

// mm per unit at which n samples have about the spacing that bake gives by default.
float default_scale(const char* preset, const SurfaceSamples& samples) {
  double area = 0;
  for (const float a : samples.areas) area += static_cast<double>(a);
  const double spacing = hexagonal_spacing(area, static_cast<double>(samples.size()));
  return static_cast<float>(
      0.65 * static_cast<double>(smallest_mean_free_path(make_medium(*find_preset(preset)))) / spacing);
}

class EveryKind : public testing::TestWithParam<ProfileKind> {};
INSTANTIATE_TEST_SUITE_P(Kinds, EveryKind, testing::ValuesIn(kKinds));

TEST_P(EveryKind, ZeroToleranceIsTheExactSumBitForBit) {
  for (const Shape& shape : kShapes) {
    const OwnedGroup owned = make_group(shape.make(24, &side_light));
    const Exitance exitance(owned.group, make_material("Marble", GetParam(), 20), 0);
    Rng rng(3);
    for (int i = 0; i < 50; ++i) {
      const Vec3 x = shape.point(rng);
      std::uint64_t a = 0, b = 0;
      const Rgb m = eval(exitance, {&x, 1}, a)[0];
      Rgb exact;
      exitance.eval_exact({&x, 1}, {&exact, 1}, b);
      EXPECT_EQ(m, exact);
      EXPECT_EQ(a, owned.group.size());
      EXPECT_EQ(b, owned.group.size());
    }
  }
}

// Table, float arithmetic and all.
TEST_P(EveryKind, ExactSumIsTheClosedForm) {
  for (const char* preset : {"Marble", "Spectralon", "Skin1"})
    for (const Shape& shape : kShapes) {
      const SurfaceSamples samples = shape.make(20, &coloured_light);
      const OwnedGroup owned = make_group(samples);
      const Medium medium = make_material(preset, GetParam(), default_scale(preset, samples));
      const Exitance exitance(owned.group, medium, 0);
      const double bound = 1e-5;
      Rng rng(4);
      for (int i = 0; i < 8; ++i) {
        const Vec3 x = shape.point(rng);
        const Rgb m = eval(exitance, x);
        const auto expected = reference(samples, medium, x);
        for (std::size_t k = 0; k < 3; ++k)
          EXPECT_NEAR(static_cast<double>(m[static_cast<int>(k)]) / expected[k], 1, bound)
              << preset << " " << shape.name << " " << k;
      }
    }
}

TEST_P(EveryKind, RelativeErrorIsWithinTheTolerance) {
  for (const char* preset : {"Marble", "Spectralon", "Skin1", "Ketchup"})
    for (const Shape& shape : kShapes)
      for (const Lighting& lighting : kLightings) {
        const SurfaceSamples samples = shape.make(shape.n, lighting.light);
        const OwnedGroup owned = make_group(samples);
        const float scale = default_scale(preset, samples);
        for (const float coarser :
             {1.0f, 4.0f, 8.0f, 16.0f, 128.0f}) {  // a large mean free path sees many samples at once
          const Medium medium = make_material(preset, GetParam(), scale / coarser);
          const Exitance exact(owned.group, medium, 0);
          std::vector<Vec3> points;
          std::vector<Rgb> expected;
          Rng rng(5);
          double norm[3]{};
          for (int i = 0; i < 150; ++i) {
            points.push_back(shape.point(rng));
            expected.push_back(eval(exact, points.back()));
            for (int k = 0; k < 3; ++k) norm[k] += square(static_cast<double>(expected.back()[k]));
          }
          for (const double tolerance : {0.1, 0.01, 0.001}) {
            const Exitance fast(owned.group, medium, tolerance);
            double error[3]{};
            std::uint64_t evaluations = 0;
            const std::vector<Rgb> values = eval(fast, points, evaluations);
            for (std::size_t i = 0; i < points.size(); ++i) {
              const Rgb m = values[i];
              for (int k = 0; k < 3; ++k) {
                ASSERT_TRUE(std::isfinite(m[k]) && m[k] >= 0);
                error[k] += square(static_cast<double>(m[k]) - static_cast<double>(expected[i][k]));
              }
            }
            for (int k = 0; k < 3; ++k)
              EXPECT_LE(std::sqrt(error[k]), tolerance * std::sqrt(norm[k]))
                  << preset << ", " << shape.name << ", " << lighting.name << ", x" << coarser
                  << ", tolerance " << tolerance << ", channel " << k;
            if (tolerance == 0.1 && coarser <= 8) {
              EXPECT_LT(evaluations, points.size() * samples.size() / 2)
                  << preset << " " << shape.name << " " << lighting.name;
            }
          }
        }
      }
}

// Every point and channel, not their mean; as far from the exact sum as the tables let one say.
TEST_P(EveryKind, CertifiedErrorIsWithinTheToleranceEverywhere) {
  for (const char* preset : {"Marble", "Skin1", "Ketchup"})
    for (const Shape& shape : kShapes)
      for (const Lighting& lighting : kLightings) {
        const SurfaceSamples samples = shape.make(shape.n / 2, lighting.light);
        const OwnedGroup owned = make_group(samples);
        const float scale = default_scale(preset, samples);
        for (const float coarser : {1.0f, 4.0f}) {
          const Medium medium = make_material(preset, GetParam(), scale / coarser);
          const Exitance exact(owned.group, medium, 0);
          std::vector<Vec3> points;
          Rng rng(15);
          for (int i = 0; i < 100; ++i) points.push_back(shape.point(rng));
          for (const double tolerance : {0.5, 0.05, 0.01}) {
            const Exitance fast(owned.group, medium, tolerance, Promise::kCertified);
            std::uint64_t evaluations = 0;
            const std::vector<Rgb> values = eval(fast, points, evaluations);
            for (std::size_t i = 0; i < points.size(); ++i) {
              const Rgb expected = eval(exact, points[i]);
              for (int k = 0; k < 3; ++k)
                ASSERT_LE(std::abs(double{values[i][k]} - double{expected[k]}),
                          tolerance * double{expected[k]})
                    << preset << ", " << shape.name << ", " << lighting.name << ", tolerance " << tolerance;
            }
          }
        }
      }
}

// And they are sums of nodes, not of all samples.
TEST_P(EveryKind, CertifiedSumsAreHierarchical) {
  const SurfaceSamples samples = make_sphere(200, &side_light);
  const OwnedGroup owned = make_group(samples);
  const Medium medium = make_material("Marble", GetParam(), default_scale("Marble", samples));
  const Exitance fast(owned.group, medium, 0.05, Promise::kCertified);
  std::vector<Vec3> points;
  Rng rng(16);
  for (int i = 0; i < 50; ++i) points.push_back(on_sphere(rng));
  std::uint64_t evaluations = 0;
  eval(fast, points, evaluations);
  EXPECT_LT(evaluations, points.size() * samples.size() / 2);
}

TEST_P(EveryKind, TolerancesBelowTheAccuracyOfTablesAreNotCertified) {
  const OwnedGroup owned = make_group(make_plane(20, &uniform_light));
  const Medium medium = make_material("Marble", GetParam(), 20);
  try {
    const Exitance exitance(owned.group, medium, 1e-5, Promise::kCertified);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kLimit);
    EXPECT_NE(std::string(error.what()).find("certified"), std::string::npos) << error.what();
  }
}

// Points that are all there is in their blocks: the error is the same, whatever the density of points.
TEST_P(EveryKind, WholeBlocksAreWithinTheTolerance) {
  for (const char* preset : {"Marble", "Ketchup"})
    for (const Shape& shape : kShapes)
      for (const Lighting& lighting : kLightings) {
        const SurfaceSamples samples = shape.make(shape.n / 2, lighting.light);
        const OwnedGroup owned = make_group(samples);
        const Medium medium = make_material(preset, GetParam(), default_scale(preset, samples));
        const Exitance fast(owned.group, medium, 0.01), exact(owned.group, medium, 0);
        for (const int count : {100, 20000}) {
          std::vector<Vec3> points;
          Rng rng(25);
          for (int i = 0; i < count; ++i) points.push_back(shape.point(rng));
          std::vector<Rgb> values(points.size());
          std::uint64_t evaluations = 0;
          fast.eval_whole(points, values, evaluations);
          double error[3]{}, norm[3]{};
          for (std::size_t i = 0; i < points.size(); i += points.size() / 100) {
            const Rgb expected = eval(exact, points[i]);
            for (int k = 0; k < 3; ++k) {
              error[k] += square(double{values[i][k]} - double{expected[k]});
              norm[k] += square(double{expected[k]});
            }
          }
          for (int k = 0; k < 3; ++k)
            EXPECT_LE(std::sqrt(error[k]), 0.01 * std::sqrt(norm[k]))
                << preset << ", " << shape.name << ", " << lighting.name << ", " << count << ", channel "
                << k;
        }
      }
}

// A point's value depends neither on the points it is evaluated with nor on their order.
TEST_P(EveryKind, ValuesDoNotDependOnCompany) {
  const OwnedGroup owned = make_group(kShapes[0].make(40, &side_light));
  const Exitance exitance(owned.group, make_material("Marble", GetParam(), 20), 0.01);
  Rng rng(6);
  std::vector<Vec3> points;
  for (int i = 0; i < 300; ++i) points.push_back(kShapes[0].point(rng));
  std::uint64_t evaluations = 0;
  const std::vector<Rgb> together = eval(exitance, points, evaluations);
  const std::vector<Vec3> reversed(points.rbegin(), points.rend());
  const std::vector<Rgb> backwards = eval(exitance, reversed, evaluations);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(together[i], eval(exitance, points[i]));
    EXPECT_EQ(together[i], backwards[points.size() - 1 - i]);
  }
}

// The radial integral of R over the plane is the profile's total; a finite disc misses the tail. Dipoles
// without absorption fall like sum of z/(4 pi) r^-3, so that a plane of radius s misses weight/(2 s) of the
// z's.
TEST_P(EveryKind, LargePlaneUnderUniformLightGivesTheTotal) {
  for (const char* preset : {"Marble", "Spectralon", "Skin1"}) {
    const int n = 400;
    const SurfaceSamples samples = make_plane(n, &uniform_light);
    const OwnedGroup owned = make_group(samples);
    const Medium medium = make_material(preset, GetParam(), 0.8f * default_scale(preset, samples));
    const auto profiles = make_profiles(medium);
    const Exitance exact(owned.group, medium, 0);
    double mean[3]{};
    constexpr int kPoints = 200;
    Rng rng(6);
    for (int i = 0; i < kPoints; ++i) {
      // Near the middle, at random places between samples.
      const Rgb m = eval(exact, on_plane(rng) * 0.03f);
      for (int k = 0; k < 3; ++k) mean[k] += static_cast<double>(m[k]) / kPoints;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      // What lies outside of the square, seen from its middle: eight times the part over the triangle
      // 0 < y < x, x > 1, in polar coordinates.
      double tail = 0;
      constexpr int kAngles = 64;
      for (int a = 0; a < kAngles; ++a) {
        const double low = 1 / std::cos(kPiD / 4 * (a + 0.5) / kAngles);
        for (double u = std::log(low); u < std::log(low) + 14; u += 0.005) {
          const double r = std::exp(u + 0.0025);
          tail += eval_profile(profiles[k], r) * r * r * 0.005 * (2 * kPiD / kAngles);
        }
      }
      EXPECT_NEAR((mean[k] + tail) / profiles[k].total, 1, 0.005)
          << preset << " " << k << " " << mean[k] << " " << tail;
    }
  }
}

// A leaf of one sample has no extent: a point right at it must not take it for a power without bound.
TEST_P(EveryKind, PointsAtSamplesAreLikeAnyOther) {
  for (const char* preset : {"Marble", "Spectralon"})
    for (const Shape& shape : kShapes) {
      const SurfaceSamples samples = shape.make(shape.n, &side_light);
      const OwnedGroup owned = make_group(samples);
      const Medium medium = make_material(preset, GetParam(), default_scale(preset, samples));
      const Exitance fast(owned.group, medium, 0.01), exact(owned.group, medium, 0);
      double error[3]{}, norm[3]{};
      for (std::size_t i = 0; i < samples.size(); i += 29) {
        const Rgb m = eval(fast, samples.positions[i]), e = eval(exact, samples.positions[i]);
        for (int k = 0; k < 3; ++k) {
          ASSERT_TRUE(std::isfinite(m[k]));
          error[k] += square(static_cast<double>(m[k]) - static_cast<double>(e[k]));
          norm[k] += square(static_cast<double>(e[k]));
        }
      }
      for (int k = 0; k < 3; ++k)
        EXPECT_LE(std::sqrt(error[k]), 0.01 * std::sqrt(norm[k])) << preset << " " << shape.name << " " << k;
    }
}

TEST_P(EveryKind, FarAwayIsDarkAndNeverNaN) {
  const OwnedGroup owned = make_group(make_sphere(16, &uniform_light));
  for (const char* preset : {"Marble", "Spectralon", "Skin1"})
    for (const double tolerance : {0.0, 0.01}) {
      const Exitance exitance(owned.group, make_material(preset, GetParam(), 50), tolerance);
      Rgb previous = eval(exitance, {1, 0, 0});
      for (const float x : {3.0f, 1e2f, 1e4f, 1e10f, 1e20f, 3e38f}) {
        const Rgb m = eval(exitance, {x, 0, -x});
        for (int k = 0; k < 3; ++k) {
          EXPECT_TRUE(m[k] >= 0 && m[k] <= previous[k]) << preset << " " << x << " " << m[k];
        }
        previous = m;
      }
      EXPECT_EQ(previous, Rgb(0, 0, 0));
    }
}

// A scene in other units is the same scene: by powers of two to the bit, at whatever length.
TEST_P(EveryKind, UnitsDoNotMatter) {
  const SurfaceSamples samples = make_sphere(48, &side_light);
  const auto evaluate = [&](float unit) {
    SurfaceSamples scaled = samples;
    for (Vec3& p : scaled.positions) p *= unit;
    for (float& area : scaled.areas) area *= unit * unit;
    const Medium medium = make_material("Marble", GetParam(), 5 / unit);
    const OwnedGroup owned = make_group(scaled);
    std::vector<Vec3> points;
    for (std::size_t i = 0; i < scaled.size(); i += 13) points.push_back(1.01f * scaled.positions[i]);
    std::uint64_t evaluations = 0;
    std::vector<Rgb> values = eval(Exitance(owned.group, medium, 0.01), points, evaluations);
    const std::vector<Rgb> exact = eval(Exitance(owned.group, medium, 0), points, evaluations);
    values.insert(values.end(), exact.begin(), exact.end());
    return values;
  };
  const std::vector<Rgb> wanted = evaluate(1);
  for (const float unit : {0x1p-24f, 0x1p-17f, 0x1p-8f, 0x1p10f, 0x1p24f})
    EXPECT_TRUE(evaluate(unit) == wanted) << unit;
}

TEST_P(EveryKind, DarkAndEmptyGroupsGiveZero) {
  SurfaceSamples dark = make_sphere(16, [](const Vec3&, const Vec3&) { return Rgb(0, 0, 0); });
  const OwnedGroup owned = make_group(dark), empty = make_group({});
  for (const double tolerance : {0.0, 0.01}) {
    const Exitance exitance(owned.group, make_material("Skin1", GetParam(), 50), tolerance);
    const Exitance nothing(empty.group, make_material("Skin1", GetParam(), 50), tolerance);
    for (const Vec3& x : {dark.positions[5], Vec3(0, 0, 0), Vec3(4, 0, 0)}) {
      EXPECT_EQ(eval(exitance, x), Rgb(0, 0, 0));
      EXPECT_EQ(eval(nothing, x), Rgb(0, 0, 0));
    }
  }
}

// One channel without light is black whatever the others do.
TEST_P(EveryKind, DarkChannelsStayDark) {
  const OwnedGroup owned =
      make_group(make_sphere(32, [](const Vec3& p, const Vec3&) { return Rgb(0, std::max(0.0f, p.x), 0); }));
  const Exitance exitance(owned.group, make_material("Marble", GetParam(), 20), 0.01);
  Rng rng(8);
  for (int i = 0; i < 100; ++i) {
    const Rgb m = eval(exitance, on_sphere(rng));
    EXPECT_EQ(m.x, 0);
    EXPECT_GT(m.y, 0);
    EXPECT_EQ(m.z, 0);
  }
}

TEST_P(EveryKind, SamplesWithoutAreaGiveNothing) {
  SurfaceSamples samples = make_plane(10, &uniform_light);
  for (std::size_t i = 0; i < samples.size(); ++i) samples.areas[i] = i % 2 ? 0 : 1e-45f;
  const OwnedGroup owned = make_group(samples);
  const Exitance exitance(owned.group, make_material("Marble", GetParam(), 20), 0.01);
  for (const Vec3& x : {samples.positions[0], samples.positions[1], Vec3(0, 0, 0)})
    for (int k = 0; k < 3; ++k) {
      const float m = eval(exitance, x)[k];
      EXPECT_TRUE(m >= 0 && m < 1e-30f) << m;
    }
}

}  // namespace
}  // namespace nacre
