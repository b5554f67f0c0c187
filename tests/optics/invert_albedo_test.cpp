// label: analytic
// Albedo inversion against the profiles that it inverts.
#include "nacre/optics/invert_albedo.h"

#include <gtest/gtest.h>

#include "nacre/optics/profile.h"

namespace nacre {
namespace {

constexpr ProfileKind kProfiles[] = {ProfileKind::kDipole, ProfileKind::kBetterDipole,
                                     ProfileKind::kNormalized};

// By way of a Medium, as scenes and bakes see it: its coefficients are floats.
Profile profile_of(ProfileKind kind, const DiffusionCoefficients& c, float eta) {
  Medium medium;
  medium.profile = kind;
  medium.sigma_s = Rgb(static_cast<float>(c.sigma_s_prime));
  medium.sigma_a = Rgb(static_cast<float>(c.sigma_a));
  medium.int_ior = eta;
  medium.ext_ior = 1;
  return make_profiles(medium)[0];
}

TEST(InvertAlbedo, TotalComesBack) {
  for (const ProfileKind kind : kProfiles)
    for (const float eta : {0.7f, 0.9f, 1.0f, 1.1f, 1.3f, 1.5f, 2.0f, 2.5f})
      for (const double mean_free_path : {1e-3, 0.7, 40.0})
        for (const double albedo : {0.0, 1e-4, 0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 0.999, 0.9999, 1.0}) {
          const DiffusionCoefficients c = invert_albedo(kind, albedo, mean_free_path, double{eta});
          EXPECT_NEAR(1 / (c.sigma_s_prime + c.sigma_a), mean_free_path, 1e-9 * mean_free_path);
          EXPECT_NEAR(profile_of(kind, c, eta).total, albedo, 1e-5)
              << kProfileNames[static_cast<std::size_t>(kind)] << " eta " << eta;
        }
}

TEST(InvertAlbedo, MarbleComesBack) {
  const DiffusionCoefficients c =
      invert_albedo(ProfileKind::kDipole, 0.830191456277, 1 / (2.19 + 0.0021), 1.5);
  EXPECT_NEAR(c.sigma_s_prime, 2.19, 1e-6);
  EXPECT_NEAR(c.sigma_a, 0.0021, 1e-8);
}

TEST(InvertAlbedo, WhiteAbsorbsNothingAndBlackScattersNothing) {
  for (const ProfileKind kind : kProfiles) {
    EXPECT_DOUBLE_EQ(largest_albedo(kind, 1.4), 1);
    EXPECT_NEAR(invert_albedo(kind, 1, 2, 1.4).sigma_a, 0, 1e-15);
    EXPECT_EQ(invert_albedo(kind, 0, 2, 1.4).sigma_s_prime, 0);
  }
}

// What bisection rests on.
TEST(InvertAlbedo, AbsorptionFallsAsReflectanceGrows) {
  for (const ProfileKind kind : kProfiles)
    for (const double eta : {0.8, 1.0, 1.5, 2.5}) {
      double last = 2;
      for (int i = 0; i <= 200; ++i) {
        const double sigma_a = invert_albedo(kind, i / 200.0, 1, eta).sigma_a;
        EXPECT_LT(sigma_a, last) << i;
        last = sigma_a;
      }
    }
}

}  // namespace
}  // namespace nacre
