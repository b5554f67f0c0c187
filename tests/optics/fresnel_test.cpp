// label: analytic
// Fresnel terms against closed forms, tabulated means and independent quadrature.
#include "nacre/optics/fresnel.h"

#include <gtest/gtest.h>

#include <complex>

namespace nacre {
namespace {

TEST(Fresnel, NormalIncidence) {
  EXPECT_NEAR(fresnel_reflectance(1.0, 1.5), 0.04, 1e-12);
  EXPECT_NEAR(fresnel_reflectance(1.0, 1 / 1.5), 0.04, 1e-12);
}

TEST(Fresnel, GrazingReflectsAll) { EXPECT_NEAR(fresnel_reflectance(0.0, 1.3), 1, 1e-12); }

TEST(Fresnel, BrewsterAngleReflectsOnlyS) {
  const double cos_b = 1 / std::sqrt(1 + 1.5 * 1.5);
  const double cos_t = std::sqrt(1 - (1 - cos_b * cos_b) / 2.25);
  const double r_s = (cos_b - 1.5 * cos_t) / (cos_b + 1.5 * cos_t);
  EXPECT_NEAR(fresnel_reflectance(cos_b, 1.5), r_s * r_s / 2, 1e-12);
}

TEST(Fresnel, TotalInternalReflection) {
  const double critical = std::sqrt(1 - 1 / 2.25);
  EXPECT_EQ(fresnel_reflectance(critical - 1e-6, 1 / 1.5), 1);
  EXPECT_LT(fresnel_reflectance(critical + 1e-3, 1 / 1.5), 1);
}

// The same angle seen from both sides reflects alike (Stokes).
TEST(Fresnel, SameFromBothSides) {
  for (double cos_i = 0.05; cos_i < 1; cos_i += 0.1) {
    const double cos_t = std::sqrt(1 - (1 - cos_i * cos_i) / (1.4 * 1.4));
    EXPECT_NEAR(fresnel_reflectance(cos_i, 1.4), fresnel_reflectance(cos_t, 1 / 1.4), 1e-12) << cos_i;
  }
}

TEST(Fresnel, DiffuseReflectanceFit) {
  EXPECT_NEAR(fresnel_diffuse_reflectance(1.5), -1.440 / 2.25 + 0.710 / 1.5 + 0.668 + 0.0636 * 1.5, 1e-12);
  EXPECT_NEAR(fresnel_diffuse_reflectance(0.8), -0.4399 + 0.7099 / 0.8 - 0.3319 / 0.64 + 0.0636 / 0.512,
              1e-12);
}

TEST(Fresnel, MeanTransmittance) {
  EXPECT_NEAR(mean_transmittance(1.3), 0.9389, 5e-5);
  EXPECT_NEAR(mean_transmittance(1.5), 0.9082, 5e-5);
  EXPECT_NEAR(mean_transmittance(1.0), 1, 1e-12);
}

// Plain midpoint sums with very many points.
TEST(Fresnel, InternalMomentsAgreeWithBruteForce) {
  for (const double eta : {1.1, 1.3, 1.5, 2.0, 0.8}) {
    double c1 = 0, c2 = 0;
    constexpr int kPoints = 2000000;
    for (int i = 0; i < kPoints; ++i) {
      const double mu = (i + 0.5) / kPoints;
      const double f = fresnel_reflectance(mu, 1 / eta);
      c1 += f * mu / kPoints;
      c2 += f * mu * mu / kPoints;
    }
    const FresnelMoments m = internal_fresnel_moments(eta);
    EXPECT_NEAR(m.c1, c1, 1e-7) << eta;
    EXPECT_NEAR(m.c2, c2, 1e-7) << eta;
  }
}

// What enters diffusely equals, by reciprocity, what leaves diffusely times eta^2.
TEST(Fresnel, MomentsSatisfyReciprocity) {
  for (const double eta : {1.2, 1.5}) {
    const double out = 1 - 2 * internal_fresnel_moments(eta).c1;
    EXPECT_NEAR(mean_transmittance(eta), eta * eta * out, 1e-7);
  }
}

TEST(Refract, ObeysSnell) {
  const Vec3 n(0, 0, 1);
  const Vec3 in = Vec3(0.6f, 0, 0.8f);
  Vec3 out;
  ASSERT_TRUE(refract(in, n, 1.5f, out));
  EXPECT_NEAR(out.x, -0.4f, 1e-6);
  EXPECT_NEAR(out.z, -std::sqrt(1 - 0.16f), 1e-6);
  EXPECT_FALSE(refract(Vec3(0.9f, 0, std::sqrt(1 - 0.81f)), n, 1 / 1.5f, out));
}

TEST(Reflect, Mirrors) {
  const Vec3 r = reflect(Vec3(0.6f, 0, 0.8f), Vec3(0, 0, 1));
  EXPECT_NEAR(r.x, -0.6f, 1e-6);
  EXPECT_NEAR(r.z, 0.8f, 1e-6);
}

// At normal incidence ((eta - 1)^2 + k^2) / ((eta + 1)^2 + k^2); without k a dielectric; all of it at grazing
// incidence and of a perfect mirror.
TEST(Fresnel, ConductorHasItsLimits) {
  EXPECT_NEAR(fresnel_conductor(1, 0.2f, 3.9f), (0.64 + 15.21) / (1.44 + 15.21), 1e-6);
  for (const float cosine : {0.0f, 1e-3f, 0.1f, 0.5f, 0.9f, 1.0f}) {
    EXPECT_NEAR(fresnel_conductor(cosine, 1.5f, 0), fresnel_reflectance(cosine, 1.5f), 2e-6);
    EXPECT_EQ(fresnel_conductor(cosine, 0, 1), 1);
    for (const float eta : {0.0f, 0.1f, 1.0f, 3.0f, 1000.0f})
      for (const float k : {0.0f, 0.1f, 5.0f, 1000.0f}) {
        EXPECT_GE(fresnel_conductor(cosine, eta, k), 0);
        EXPECT_LE(fresnel_conductor(cosine, eta, k), 1);
      }
  }
  EXPECT_EQ(fresnel_conductor(0, 1.4f, 7.6f), 1);
}

// Against the amplitudes in complex arithmetic.
TEST(Fresnel, ConductorMatchesComplexAmplitudes) {
  for (const std::complex<double> n : {std::complex<double>(0.2, 3.9), {1.4, 7.6}, {3.6, 4.3}})
    for (const double cosine : {0.05, 0.3, 0.7, 0.95}) {
      const std::complex<double> cos_t = std::sqrt(1.0 - (1 - cosine * cosine) / (n * n));
      const auto r_s = (cosine - n * cos_t) / (cosine + n * cos_t);
      const auto r_p = (n * cosine - cos_t) / (n * cosine + cos_t);
      EXPECT_NEAR(fresnel_conductor(static_cast<float>(cosine), static_cast<float>(n.real()),
                                    static_cast<float>(n.imag())),
                  (std::norm(r_s) + std::norm(r_p)) / 2, 1e-5);
    }
}

}  // namespace
}  // namespace nacre
