// label: analytic
// Materials whose sums are made of the same nodes: what belongs together, and that each is as right as alone.
#include "nacre/cache/material_family.h"

#include <gtest/gtest.h>

#include "cache/sample_sets.h"
#include "nacre/base/error.h"
#include "nacre/cache/exitance.h"
#include "nacre/optics/eta_change.h"

namespace nacre {
namespace {

using namespace testing_support;

// Of mean free paths up to eight times the shortest, from hardly absorbing to where half is, in one channel
// or another; forward scattering or not.
std::vector<Medium> make_plan(ProfileKind profile, float scale) {
  std::vector<Medium> plan;
  const Rgb tints[] = {{1, 1, 1}, {0.01f, 0.1f, 1}, {1, 0.05f, 0.2f}};
  for (const Rgb& tint : tints)
    for (const float absorption : {0.0002f, 0.02f, 0.15f, 0.6f}) {
      Medium medium;
      medium.profile = profile;
      medium.scale = scale * std::exp2(-3.0f * static_cast<float>(plan.size() * 5 % 12) / 11);
      medium.g = Rgb(absorption < 0.02f ? 0.5f : 0.0f);
      for (int k = 0; k < 3; ++k) {
        medium.sigma_a[k] = absorption * tint[k];
        medium.sigma_s[k] = (1.2f - medium.sigma_a[k]) / (1 - medium.g[k]);
      }
      plan.push_back(medium);
    }
  return plan;
}

Vec3 on_sphere(Rng& rng) {
  const float z = 2 * rng.next_float() - 1, phi = 2 * kPi * rng.next_float(), s = std::sqrt(1 - z * z);
  return {s * std::cos(phi), s * std::sin(phi), z};
}

class EveryKind : public testing::TestWithParam<ProfileKind> {};
INSTANTIATE_TEST_SUITE_P(Kinds, EveryKind,
                         testing::Values(ProfileKind::kDipole, ProfileKind::kBetterDipole,
                                         ProfileKind::kNormalized));

TEST_P(EveryKind, EachMemberIsWithinTheTolerance) {
  Rgb (*const lights[])(const Vec3&, const Vec3&) = {&uniform_light, &side_light, &coloured_light,
                                                     &spot_light};
  for (std::size_t light = 0; light < std::size(lights); ++light)
    for (const float scale : {40.0f, 10.0f, 2.0f}) {
      const OwnedGroup owned = make_group(make_sphere(64, lights[light]));
      const std::vector<Medium> plan = make_plan(GetParam(), scale);
      MaterialFamily family{plan, {}};
      for (std::uint32_t m = 0; m < plan.size(); ++m) family.wanted.push_back(m);
      std::vector<Vec3> points;
      Rng rng(23);
      for (int i = 0; i < 100; ++i) points.push_back(on_sphere(rng));
      std::vector<Rgb> expected(points.size() * plan.size()), values(expected.size());
      std::uint64_t evaluations = 0;
      Exitance(owned.group, family, 0).eval(points, expected, evaluations);
      for (const double tolerance : {0.1, 0.01, 0.001}) {
        Exitance(owned.group, family, tolerance).eval(points, values, evaluations);
        for (std::size_t m = 0; m < plan.size(); ++m)
          for (int k = 0; k < 3; ++k) {
            double error = 0, norm = 0;
            for (std::size_t i = m; i < values.size(); i += plan.size()) {
              error += square(double{values[i][k]} - double{expected[i][k]});
              norm += square(double{expected[i][k]});
            }
            EXPECT_LE(std::sqrt(error), tolerance * std::sqrt(norm))
                << "light " << light << ", scale " << scale << ", tolerance " << tolerance << ", material "
                << m << ", channel " << k;
          }
      }
    }
}

// Light at all angles, of which each member lets in its own share.
TEST_P(EveryKind, MembersOfSeveralIndicesAreWithinTheTolerance) {
  const auto light = [](double eta) {
    return [shares = entering_shares(eta)](const Vec3& p, const Vec3& n) {
      const double share = shares[static_cast<std::size_t>(2.5f * (p.y + 0.999f))];
      return side_light(p, n) * static_cast<float>(share);
    };
  };
  std::vector<Medium> plan = make_plan(GetParam(), 10);
  for (std::size_t m = 0; m < plan.size(); ++m) {
    plan[m].ext_ior = 1;
    plan[m].int_ior = 1.2f + 0.05f * static_cast<float>(m * 5 % 12);
  }
  EXPECT_LT(sort_materials(plan, {}, true).families.size(), sort_materials(plan, {}).families.size());
  MaterialFamily family{plan, {}};
  for (std::uint32_t m = 0; m < plan.size(); ++m) family.wanted.push_back(m);
  std::vector<Vec3> points;
  Rng rng(31);
  for (int i = 0; i < 60; ++i) points.push_back(on_sphere(rng));
  points.emplace_back(1e4f, 0, 0);
  const OwnedGroup least = make_group(make_sphere(48, light(double{eta_range(family).least})));
  const IrradianceForEta irradiance = [&](double eta) {
    std::array<std::vector<float>, 3> planes;
    const auto of_eta = light(eta);
    for (std::size_t i = 0; i < least.group.size(); ++i)
      for (std::size_t k = 0; k < 3; ++k)
        planes[k].push_back(of_eta(least.group.position(i), least.group.normal(i))[static_cast<int>(k)]);
    return planes;
  };
  for (const double tolerance : {0.1, 0.01, 0.001}) {
    const Exitance exitance(least.group, family, tolerance, Promise::kCalibrated, irradiance);
    std::vector<Rgb> values(points.size() * plan.size()), expected(points.size());
    std::uint64_t evaluations = 0;
    exitance.eval(points, values, evaluations);
    for (std::size_t m = 0; m < plan.size(); ++m) {
      const Medium& medium = family.media[m];
      const OwnedGroup own = make_group(make_sphere(48, light(double{medium.eta()})));
      Exitance(own.group, medium, 0).eval(points, expected, evaluations);
      for (int k = 0; k < 3; ++k) {
        double error = 0, norm = 0;
        for (std::size_t i = 0; i < points.size(); ++i) {
          error += square(double{values[i * plan.size() + m][k]} - double{expected[i][k]});
          norm += square(double{expected[i][k]});
        }
        EXPECT_LE(std::sqrt(error), tolerance * std::sqrt(norm)) << tolerance << " " << m << " " << k;
      }
    }
  }
  EXPECT_THROW(Exitance(least.group, family, 0, Promise::kCalibrated, irradiance), Error);
  EXPECT_THROW(Exitance(least.group, family, 0.01, Promise::kCertified, irradiance), Error);
}

// Whichever are wanted, and as the only member the same as without a family.
TEST_P(EveryKind, ValuesDoNotDependOnWhatIsWanted) {
  const OwnedGroup owned = make_group(make_sphere(48, &side_light));
  const std::vector<Medium> plan = make_plan(GetParam(), 10);
  std::vector<Vec3> points;
  Rng rng(29);
  for (int i = 0; i < 40; ++i) points.push_back(on_sphere(rng));
  const auto eval = [&](const MaterialFamily& family) {
    std::vector<Rgb> values(points.size() * family.wanted.size());
    std::uint64_t evaluations = 0;
    Exitance(owned.group, family, 0.01).eval(points, values, evaluations);
    return values;
  };
  const std::vector<std::uint32_t> some{7, 0, 3};
  std::vector<std::uint32_t> all(plan.size());
  for (std::uint32_t m = 0; m < all.size(); ++m) all[m] = m;
  const std::vector<Rgb> of_all = eval({plan, all}), of_some = eval({plan, some});
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = 0; j < some.size(); ++j)
      ASSERT_EQ(of_some[i * some.size() + j], of_all[i * all.size() + some[j]]) << i << " " << j;
  std::vector<Rgb> alone(points.size());
  std::uint64_t evaluations = 0;
  Exitance(owned.group, plan[5], 0.01).eval(points, alone, evaluations);
  EXPECT_EQ(eval({{plan[5]}, {0}}), alone);
}

TEST(MaterialFamily, BelongsTogetherWhatIsAlike) {
  Medium medium = make_material("Marble", ProfileKind::kDipole, 1);
  std::vector<Medium> plan{medium};
  const auto add = [&](const auto& change) {
    plan.push_back(medium);
    change(plan.back());
  };
  add([](Medium& m) { m.sigma_a *= 1.5f; });
  add([](Medium& m) { m.sigma_s *= 3.0f; });
  add([](Medium& m) { m.int_ior = 1.7f; });
  add([](Medium& m) { m.profile = ProfileKind::kNormalized; });
  add([](Medium& m) {
    m.sigma_a = m.sigma_s * 0.9f;
    m.sigma_s *= 0.1f;
  });
  add([](Medium& m) { m.scale *= 0.1f; });
  add([](Medium&) {});
  const MaterialFamilies sorted = sort_materials(plan, {});
  EXPECT_EQ(sorted.families.size(), 4u);
  const std::uint32_t family = sorted.places[0].family;
  EXPECT_EQ(sorted.families[family].media.size(), 5u);
  for (const std::size_t i : {1, 2, 5, 7}) EXPECT_EQ(sorted.places[i].family, family) << i;
  EXPECT_TRUE(sorted.families[family].wanted.empty());
}

// Samples further apart than a mean free path: M_o of those is not interpolated, that of others is.
TEST(MaterialFamily, IsApartWhereSamplesAreSparse) {
  std::vector<Medium> plan(4, make_material("Marble", ProfileKind::kDipole, 1));
  const double length = shortest_length(plan);
  plan[1].scale = 0.5f;
  plan[2].scale = 1.5f;
  EXPECT_EQ(sort_materials(plan, {0.6 * length}).families.size(), 1u);
  const MaterialFamilies sorted = sort_materials(plan, {1.1 * length});
  ASSERT_EQ(sorted.families.size(), 2u);
  EXPECT_EQ(sorted.places[0].family, sorted.places[3].family);
  EXPECT_EQ(sorted.places[0].family, sorted.places[2].family);
  EXPECT_NE(sorted.places[0].family, sorted.places[1].family);
}

// Where light is absorbed on its way through the body, nodes are small; where it is not, or samples are
// sparse anyway, absorption is no reason.
TEST(MaterialFamily, IsApartWhereItMakesABodyDark) {
  std::vector<Medium> plan(4, make_material("Marble", ProfileKind::kDipole, 1));
  plan[1].sigma_a *= 2.0f;
  plan[2].sigma_a *= 30.0f;
  plan[3].sigma_a *= 40.0f;
  const double decay = make_profiles(plan[3])[2].decay(), length = shortest_length(plan);
  EXPECT_EQ(sort_materials(plan, {0, 7 / decay}).families.size(), 1u);
  const MaterialFamilies sorted = sort_materials(plan, {0, 40 / decay});
  ASSERT_EQ(sorted.families.size(), 2u);
  EXPECT_EQ(sorted.places[0].family, sorted.places[1].family);
  EXPECT_EQ(sorted.places[2].family, sorted.places[3].family);
  EXPECT_NE(sorted.places[0].family, sorted.places[2].family);
  EXPECT_EQ(sort_materials(plan, {2 * length, 40 / decay}).families.size(), 1u);
}

// A mean free path on either side of any fixed boundary.
TEST(MaterialFamily, ReachesTwoOctavesFromItsShortestMember) {
  Medium medium = make_material("Marble", ProfileKind::kDipole, 1);
  for (const float start : {0.5f, 0.7f, 0.9f, 1.1f, 1.3f, 1.9f}) {
    std::vector<Medium> plan;
    for (const float scale : {3.0f, 1.0f, 4.2f, 3.9f, 6.0f}) {
      plan.push_back(medium);
      plan.back().scale = start * 2.0f / scale;
    }
    const MaterialFamilies sorted = sort_materials(plan, {});
    ASSERT_EQ(sorted.families.size(), 2u) << start;
    EXPECT_EQ(sorted.families[0].media.size(), 3u);
    for (std::size_t i = 0; i < plan.size(); ++i)
      EXPECT_EQ(sorted.families[sorted.places[i].family].media[sorted.places[i].index].scale, plan[i].scale);
  }
}

// What lies within a small family changes nothing, what widens it does.
TEST(MaterialFamily, IsKnownByItsExtremes) {
  std::vector<Medium> plan = make_plan(ProfileKind::kDipole, 1);
  plan.resize(kFewMaterials - 1);
  const std::string digest = family_digest({plan, {}});
  const std::size_t extremes = find_extremes(plan).size();
  EXPECT_GE(extremes, 2u);
  EXPECT_LE(extremes, 4u);
  plan.insert(plan.begin() + 5, plan[1]);
  EXPECT_EQ(family_digest({plan, {}}), digest);
  plan.insert(plan.begin() + 5, plan[1]);
  EXPECT_NE(family_digest({plan, {}}), digest);
  plan.pop_back();
  plan.push_back(plan[3]);
  plan.back().sigma_a *= 1.2f;
  EXPECT_NE(family_digest({plan, {}}), digest);
}

}  // namespace
}  // namespace nacre
