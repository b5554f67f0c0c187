// label: analytic
// Surfaces conserve energy and are reciprocal.
#include "nacre/transport/bsdf.h"

#include <gtest/gtest.h>

#include "nacre/optics/fresnel.h"

namespace nacre {
namespace {

Bsdf plastic(const Rgb& diffuse, bool nonlinear, float int_ior = 1.49f) {
  PlasticSurface model;
  model.int_ior = int_ior;
  model.ext_ior = 1;
  model.diffuse_reflectance = diffuse;
  model.nonlinear = nonlinear;
  const Surface surface{"", "", model};
  return make_bsdf(&surface, nullptr);
}

// Reflected over arriving light at one angle: the integral of the diffuse part times the cosine.
Rgb diffuse_albedo(const Bsdf& bsdf, float cos_i) {
  constexpr int kSteps = 4000;
  Rgb sum(0, 0, 0);
  for (int i = 0; i < kSteps; ++i) {
    const float cos_o = (static_cast<float>(i) + 0.5f) / kSteps;
    sum += eval_diffuse(bsdf, cos_i, cos_o) * (2 * kPi * cos_o / kSteps);
  }
  return sum;
}

constexpr float kCosines[] = {0.02f, 0.1f, 0.3f, 0.6f, 0.9f, 1.0f};

TEST(Bsdf, DiffuseReflectsItsReflectance) {
  const Surface surface{"", "", DiffuseSurface{Rgb(0.2f, 0.5f, 1)}};
  const Bsdf bsdf = make_bsdf(&surface, nullptr);
  EXPECT_FALSE(bsdf.specular || bsdf.transmits || bsdf.coated);
  for (const float cosine : kCosines)
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(diffuse_albedo(bsdf, cosine)[k], Rgb(0.2f, 0.5f, 1)[k], 1e-4);
}

// What a white base under a coat does not send back diffusely is mirrored: all of the light comes back.
TEST(Bsdf, WhitePlasticLosesNothing) {
  for (const bool nonlinear : {false, true})
    for (const float ior : {1.2f, 1.49f, 2.0f}) {
      const Bsdf bsdf = plastic(Rgb(1, 1, 1), nonlinear, ior);
      for (const float cosine : kCosines)
        EXPECT_NEAR(diffuse_albedo(bsdf, cosine).x + fresnel_reflectance(cosine, bsdf.eta), 1, 2e-3);
    }
}

TEST(Bsdf, PlasticConservesEnergy) {
  for (const bool nonlinear : {false, true}) {
    const Bsdf bsdf = plastic(Rgb(0.9f, 0.5f, 0), nonlinear);
    for (const float cosine : kCosines) {
      const Rgb total = diffuse_albedo(bsdf, cosine) + Rgb(1, 1, 1) * fresnel_reflectance(cosine, bsdf.eta);
      EXPECT_LT(max_channel(total), 1);
      EXPECT_GE(min_channel(total), 0);
      EXPECT_FLOAT_EQ(diffuse_albedo(bsdf, cosine).z, 0);
    }
  }
}

// Without `nonlinear` the coat's internal reflections are white: the albedo is in proportion to the base's.
TEST(Bsdf, NonlinearPlasticIsMoreSaturated) {
  const Rgb base(0.8f, 0.4f, 0.2f);
  const Rgb linear = eval_diffuse(plastic(base, false), 0.7f, 0.5f);
  const Rgb nonlinear = eval_diffuse(plastic(base, true), 0.7f, 0.5f);
  EXPECT_NEAR(linear.x / linear.z, 4, 1e-4);
  EXPECT_GT(nonlinear.x / nonlinear.z, 4.5f);
}

TEST(Bsdf, IsReciprocal) {
  for (const Bsdf& bsdf : {plastic(Rgb(0.9f, 0.5f, 0.1f), false), plastic(Rgb(0.9f, 0.5f, 0.1f), true)})
    for (const float a : kCosines)
      for (const float b : kCosines) {
        const Rgb forth = eval_diffuse(bsdf, a, b), back = eval_diffuse(bsdf, b, a);
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(forth[k], back[k], 1e-5f * forth[k]);
      }
}

TEST(Bsdf, MissingSurfaces) {
  const Bsdf grey = make_bsdf(nullptr, nullptr);
  EXPECT_EQ(grey.diffuse, Rgb(0.5f, 0.5f, 0.5f));
  EXPECT_FALSE(grey.specular);

  Medium medium;
  medium.int_ior = 1.4f;
  medium.ext_ior = 1;
  const Bsdf boundary = make_bsdf(nullptr, &medium);
  EXPECT_TRUE(is_black(boundary.diffuse));
  EXPECT_TRUE(boundary.specular);
  EXPECT_FALSE(boundary.transmits);
  EXPECT_FLOAT_EQ(boundary.eta, 1.4f);
}

TEST(Bsdf, GlassTransmitsUnlessAMediumIsBehindIt) {
  const Surface glass{"", "", DielectricSurface{}};
  const Bsdf clear = make_bsdf(&glass, nullptr);
  EXPECT_TRUE(clear.specular && clear.transmits);
  EXPECT_FLOAT_EQ(clear.eta, 1.5046f / 1.000277f);
  EXPECT_TRUE(is_black(clear.diffuse));
  Medium medium;
  const Bsdf boundary = make_bsdf(&glass, &medium);
  EXPECT_TRUE(boundary.specular);
  EXPECT_FALSE(boundary.transmits);
  EXPECT_FLOAT_EQ(boundary.eta, medium.eta());
}

TEST(Bsdf, PlasticOverAMediumHasItsIndex) {
  const Surface surface{"", "", PlasticSurface{}};
  Medium medium;
  const Bsdf bsdf = make_bsdf(&surface, &medium);
  EXPECT_TRUE(bsdf.coated);
  EXPECT_FALSE(bsdf.transmits);
  EXPECT_FLOAT_EQ(bsdf.eta, medium.eta());
  EXPECT_EQ(bsdf.diffuse, Rgb(0.5f, 0.5f, 0.5f));
}

}  // namespace
}  // namespace nacre
