// label: analytic
// Every surface model against what holds for all of them: samples follow the density, weights are the value
// over it, light is neither made nor, beyond what single scattering drops, lost.
#include <gtest/gtest.h>

#include <memory>

#include "base/statistics.h"
#include "nacre/base/random.h"
#include "nacre/base/sampling.h"
#include "nacre/transport/bsdf.h"

namespace nacre {
namespace {

struct Case {
  std::string name;
  Bsdf bsdf;
};

template <class Model>
Bsdf make(const Model& model, bool two_sided = false) {
  Surface surface{"", "", model};
  surface.two_sided = two_sided;
  return make_bsdf(&surface, nullptr);
}
Bsdf metal(float u, float v) {
  return make(ConductorSurface{{0.2f, 0.9f, 1.1f}, {3.9f, 2.4f, 2.2f}, {1, 1, 1}, {u, v}});
}
Bsdf mirror(float u, float v) { return make(ConductorSurface{{0, 0, 0}, {1, 1, 1}, {1, 1, 1}, {u, v}}); }
Bsdf glass(float eta, float u, float v) {
  return make(DielectricSurface{eta, 1, {1, 1, 1}, {1, 1, 1}, {u, v}});
}
Bsdf plastic(const Rgb& base, bool nonlinear, float alpha) {
  return make(PlasticSurface{1.5f, 1, base, {1, 1, 1}, nonlinear, {alpha, alpha}});
}
Bsdf rough_medium() {
  const Surface surface{"", "", DielectricSurface{1.5f, 1, {1, 1, 1}, {1, 1, 1}, {0.3f, 0.3f}}};
  return make_bsdf(&surface, std::make_unique<Medium>().get());
}

std::vector<Case> cases() {
  return {{"diffuse", make(DiffuseSurface{{0.2f, 0.5f, 1}})},
          {"two-sided diffuse", make(DiffuseSurface{{0.2f, 0.5f, 1}}, true)},
          {"metal 0.1", metal(0.1f, 0.1f)},
          {"metal 0.3", metal(0.3f, 0.3f)},
          {"metal 0.7", metal(0.7f, 0.7f)},
          {"brushed metal", metal(0.15f, 0.5f)},
          {"rough glass 0.1", glass(1.5f, 0.1f, 0.1f)},
          {"rough glass 0.3", glass(1.5f, 0.3f, 0.3f)},
          {"rough glass 0.7", glass(1.5f, 0.7f, 0.7f)},
          {"brushed bubble", glass(1 / 1.4f, 0.2f, 0.4f)},
          {"rough boundary of a medium", rough_medium()},
          {"plastic", plastic({0.8f, 0.4f, 0.1f}, false, 0)},
          {"rough plastic 0.1", plastic({0.8f, 0.4f, 0.1f}, false, 0.1f)},
          {"rough plastic 0.4", plastic({0.8f, 0.4f, 0.1f}, true, 0.4f)},
          {"smooth glass", glass(1.5f, 0, 0)},
          {"smooth metal", metal(0, 0)}};
}

Vec3 direction(float cosine, float phi) {
  const float sine = std::sqrt(1 - cosine * cosine);
  return {sine * std::cos(phi), sine * std::sin(phi), cosine};
}
const std::vector<Vec3> kOut{direction(1, 0),     direction(0.8f, 0.3f), direction(0.3f, 2),
                             direction(0.08f, 4), direction(-0.9f, 1),   direction(-0.4f, 5)};

BsdfSample draw(const Bsdf& bsdf, const Vec3& out, std::uint32_t i) {
  return sample_bsdf(bsdf, out, sobol_1d(i, 11), sobol_2d(i, 7));
}

// Square of the index on the side of a direction.
float index2(const Bsdf& bsdf, const Vec3& w) {
  return bsdf.transmits && w.z < 0 ? bsdf.eta * bsdf.eta : 1.0f;
}

TEST(EveryBsdf, IsReciprocal) {
  for (const auto& [name, bsdf] : cases()) {
    int compared = 0;
    for (std::uint32_t i = 0; i < 2000; ++i) {
      Rng rng(hash_words(i));
      const Vec3 a = sample_uniform_sphere(rng.next_2d()), b = sample_uniform_sphere(rng.next_2d());
      if (std::abs(a.z) < 0.02f || std::abs(b.z) < 0.02f) continue;
      const Rgb forth = eval_bsdf(bsdf, a, b) / (std::abs(a.z) * index2(bsdf, b));
      const Rgb back = eval_bsdf(bsdf, b, a) / (std::abs(b.z) * index2(bsdf, a));
      for (int k = 0; k < 3; ++k) ASSERT_NEAR(forth[k], back[k], 2e-3f * forth[k] + 1e-6f) << name << a << b;
      compared += forth.x > 0;
    }
    EXPECT_EQ(compared > 100, bsdf.rough() || !is_black(bsdf.diffuse)) << name;
  }
}

TEST(EveryBsdf, WeightsAreValueOverDensity) {
  for (const auto& [name, bsdf] : cases())
    for (const Vec3& out : kOut)
      for (std::uint32_t i = 0; i < 500; ++i) {
        const BsdfSample sample = draw(bsdf, out, i);
        if (is_black(sample.weight)) continue;
        ASSERT_NEAR(sample.direction.length(), 1, 1e-5) << name;
        ASSERT_EQ(sample.transmitted, sample.direction.z * out.z < 0) << name;
        ASSERT_EQ(sample.delta, sample.pdf == 0) << name;
        if (sample.delta) continue;
        const float pdf = pdf_bsdf(bsdf, sample.direction, out);
        const Rgb value = eval_bsdf(bsdf, sample.direction, out);
        ASSERT_NEAR(sample.pdf, pdf, 1e-3f * pdf) << name;
        for (int k = 0; k < 3; ++k) {
          ASSERT_TRUE(std::isfinite(sample.weight[k])) << name;
          ASSERT_NEAR(sample.weight[k], value[k] / pdf, 2e-3f * sample.weight[k]) << name;
        }
      }
}

// Counts of directions in cells of theta and phi, and of samples that are delta or none.
TEST(EveryBsdf, SamplesFollowTheirDensity) {
  constexpr int kTheta = 24, kPhi = 24, kSub = 24;
  constexpr std::uint32_t kSamples = 40'000;
  for (const auto& [name, bsdf] : cases())
    for (const Vec3& out : kOut) {
      std::vector<double> counts(kTheta * kPhi + 1), expected(kTheta * kPhi + 1);
      double inside = 0;
      for (int i = 0; i < kTheta * kSub; ++i)
        for (int j = 0; j < kPhi * kSub; ++j) {
          const float theta = kPi * (static_cast<float>(i) + 0.5f) / (kTheta * kSub);
          const float phi = 2 * kPi * (static_cast<float>(j) + 0.5f) / (kPhi * kSub);
          const Vec3 in(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
          const double share = static_cast<double>(pdf_bsdf(bsdf, in, out) * std::sin(theta)) * 2 * kPiD *
                               kPiD / (kTheta * kSub * kPhi * kSub);
          expected[static_cast<std::size_t>((i / kSub) * kPhi + j / kSub)] += kSamples * share;
          inside += share;
        }
      ASSERT_LT(inside, 1.002) << name << out;
      expected.back() = std::max(0.0, kSamples * (1 - inside));
      Rng rng(hash_words(5));
      for (std::uint32_t s = 0; s < kSamples; ++s) {
        const float lobe = rng.next_float();
        const BsdfSample sample = sample_bsdf(bsdf, out, lobe, rng.next_2d());
        const Vec3& d = sample.direction;
        const float theta = std::atan2(std::hypot(d.x, d.y), d.z);
        float phi = std::atan2(d.y, d.x);
        if (phi < 0) phi += 2 * kPi;
        const int i = std::min(static_cast<int>(theta / kPi * kTheta), kTheta - 1);
        const int j = std::min(static_cast<int>(phi / (2 * kPi) * kPhi), kPhi - 1);
        const bool none = sample.delta || is_black(sample.weight);
        counts[none ? counts.size() - 1 : static_cast<std::size_t>(i * kPhi + j)] += 1;
      }
      if (expected.back() > kSamples - 1.0) {  // nothing but delta: there is one cell
        EXPECT_EQ(counts.back(), kSamples) << name;
        continue;
      }
      EXPECT_GT(testing_support::chi_square_p(counts, expected), 1e-4) << name << out << inside;
    }
}

// Share of light arriving alike from everywhere that goes to `out`, radiance over that of the side it is on.
Rgb furnace(const Bsdf& bsdf, const Vec3& out) {
  constexpr std::uint32_t kSamples = 1 << 15;
  Vec3d sum(0, 0, 0);
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const BsdfSample sample = draw(bsdf, out, i);
    const Rgb weight = sample.weight * (index2(bsdf, sample.direction) / index2(bsdf, out));
    sum += Vec3d(weight);
  }
  const Vec3d mean = sum / kSamples;
  return {static_cast<float>(mean.x), static_cast<float>(mean.y), static_cast<float>(mean.z)};
}

TEST(EveryBsdf, MakesNoLight) {
  for (const auto& [name, bsdf] : cases())
    for (const Vec3& out : kOut) {
      EXPECT_LE(max_channel(furnace(bsdf, out)), 1.002f) << name << out;
      EXPECT_GE(min_channel(furnace(bsdf, out)), 0.0f) << name << out;
    }
}

TEST(WhiteFurnace, SmoothAndDiffuseSurfacesLoseNothing) {
  const Rgb white(1, 1, 1);
  for (const Vec3& out : kOut) {
    EXPECT_NEAR(furnace(glass(1.5f, 0, 0), out).x, 1, 2e-3) << out;
    EXPECT_NEAR(furnace(make(DiffuseSurface{white}, true), out).x, 1, 2e-3) << out;
    if (out.z < 0) continue;
    EXPECT_NEAR(furnace(mirror(0, 0), out).x, 1, 2e-3) << out;
    for (const float alpha : {0.0f, 0.1f, 0.3f, 0.8f})
      for (const bool nonlinear : {false, true})
        EXPECT_NEAR(furnace(plastic(white, nonlinear, alpha), out).x, 1, 4e-3) << out << alpha;
  }
}

// What hits a second facet is dropped. The long tail of GGX makes that 7 % already at alpha = 0.2; glass
// drops less, since most of its light passes at the first facet.
TEST(WhiteFurnace, RoughSurfacesLoseWhatScattersTwice) {
  const Vec3 out = direction(0.8f, 0.3f);
  struct Row {
    float alpha;
    double mirror, glass;
  };
  for (const Row& row : {Row{0.05f, 0.0036, 0.0005}, Row{0.1f, 0.0154, 0.002}, Row{0.2f, 0.0663, 0.0094},
                         Row{0.5f, 0.3180, 0.0547}, Row{1, 0.6487, 0.1667}}) {
    EXPECT_NEAR(1 - furnace(mirror(row.alpha, row.alpha), out).x, row.mirror, 2e-3) << row.alpha;
    EXPECT_NEAR(1 - furnace(glass(1.5f, row.alpha, row.alpha), out).x, row.glass, 2e-3) << row.alpha;
  }
}

// Hardly any contrast: light passes straight on, but for what facets of 0.5 hide from each other.
TEST(WhiteFurnace, RoughGlassInItsOwnLikeIsClear) {
  for (const float eta : {1.0f, 1.0005f, 1.002f, 1.01f, 0.995f})
    for (const float alpha : {0.05f, 0.5f})
      for (const Vec3& out : {kOut[0], kOut[1], kOut[4]})
        EXPECT_NEAR(furnace(glass(eta, alpha, alpha), out).x, 1, alpha < 0.1f ? 5e-3 : 0.04)
            << eta << ' ' << alpha << out;
}

TEST(EveryBsdf, IsBlackFromBehindUnlessItHasTwoSides) {
  const Vec3 behind = direction(-0.7f, 1), in = direction(-0.5f, 3);
  for (const Bsdf& bsdf :
       {metal(0.3f, 0.3f), metal(0, 0), plastic({1, 1, 1}, false, 0.2f), make(DiffuseSurface{})}) {
    EXPECT_TRUE(is_black(eval_bsdf(bsdf, in, behind)));
    EXPECT_TRUE(is_black(draw(bsdf, behind, 3).weight));
  }
  const Bsdf both = make(ConductorSurface{{0, 0, 0}, {1, 1, 1}, {1, 1, 1}, {0.3f, 0.3f}}, true);
  const Vec3 flip(1, 1, -1);
  EXPECT_EQ(eval_bsdf(both, in, behind), eval_bsdf(both, in * flip, behind * flip));
  EXPECT_FALSE(is_black(eval_bsdf(both, in, behind)));
}

TEST(Bsdf, RoughBoundaryOfAMediumOnlyReflects) {
  const Bsdf bsdf = rough_medium();
  EXPECT_FALSE(bsdf.transmits);
  EXPECT_FLOAT_EQ(bsdf.eta, Medium().eta());
  for (std::uint32_t i = 0; i < 200; ++i) EXPECT_FALSE(draw(bsdf, kOut[1], i).transmitted);
  EXPECT_TRUE(is_black(eval_bsdf(bsdf, {0, 0, -1}, kOut[1])));
}

TEST(Bsdf, AlmostSmoothIsSmooth) {
  EXPECT_FALSE(metal(1e-4f, 1e-4f).rough());
  EXPECT_TRUE(metal(1e-4f, 0.1f).rough());
}

// A narrow lobe is the mirror direction, refracted or reflected.
TEST(Bsdf, SlightlyRoughGlassRefractsAsSmoothGlassDoes) {
  for (const Vec3& out : {kOut[1], kOut[4]})
    for (const float lobe : {0.0f, 0.9f}) {
      const BsdfSample smooth = sample_bsdf(glass(1.5f, 0, 0), out, lobe, {0.01f, 0.5f});
      const BsdfSample rough = sample_bsdf(glass(1.5f, 0.002f, 0.002f), out, lobe, {0.01f, 0.5f});
      EXPECT_EQ(smooth.transmitted, rough.transmitted);
      EXPECT_LT((smooth.direction - rough.direction).length(), 0.01f);
      EXPECT_NEAR(smooth.weight.x, rough.weight.x, 0.01f);
    }
}

}  // namespace
}  // namespace nacre
