// label: analytic
// Few kernels for many materials: how near their combinations come, and when there are none.
#include "cache/kernel_span.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "cache/sample_sets.h"
#include "nacre/optics/eta_change.h"

namespace nacre {
namespace {

using namespace testing_support;

std::vector<Response> make_sweep(ProfileKind kind, int count, float most, bool varies_eta = false) {
  std::vector<Response> responses;
  for (int i = 0; i < count; ++i) {
    Medium medium = make_material("Marble", kind, 1);
    medium.sigma_a *= 1 + (most - 1) * static_cast<float>(i) / static_cast<float>(count - 1);
    if (varies_eta) medium.int_ior = 1.2f + 0.5f * static_cast<float>(i) / static_cast<float>(count - 1);
    responses.push_back({resolved_profiles(medium, 0.2), {}});
    if (varies_eta) responses.back().entering = entering_shares(double{medium.eta()});
  }
  return responses;
}

// Each absorbs twice as much as the one before.
std::vector<Response> make_unlike() {
  std::vector<Response> responses;
  Medium medium = make_material("Marble", ProfileKind::kDipole, 1);
  for (int i = 0; i < 10; ++i, medium.sigma_a *= 2.0f)
    responses.push_back({resolved_profiles(medium, 0.2), {}});
  return responses;
}

class EveryKind : public testing::TestWithParam<ProfileKind> {};
INSTANTIATE_TEST_SUITE_P(Kinds, EveryKind,
                         testing::Values(ProfileKind::kDipole, ProfileKind::kBetterDipole,
                                         ProfileKind::kNormalized));

// At distances that are none of those it was made from.
TEST_P(EveryKind, CombinationsAreAsNearAsAsked) {
  constexpr double kFarthest = 60, kError = 5e-4;
  for (const bool varies_eta : {false, true}) {
    const auto responses = make_sweep(GetParam(), 40, varies_eta ? 1.5f : 4.0f, varies_eta);
    const auto span = find_span(responses, kFarthest, kError);
    ASSERT_TRUE(span);
    EXPECT_LE(span->basis.size(), 16u);
    EXPECT_EQ(span->basis.size(), std::ranges::max(span->counts));
    for (std::size_t m = 0; m < responses.size(); ++m)
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t angle = 0; angle < (varies_eta ? responses[m].entering.size() : 1); ++angle) {
          const auto share = [&](const Response& r) { return varies_eta ? r.entering[angle] : 1; };
          for (double r = 0.0011; r < kFarthest; r *= 1.037) {
            double sum = 0;
            for (std::size_t j = 0; j < span->basis.size(); ++j) {
              const Response& base = responses[span->basis[j][k]];
              sum += double{span->weights[m][j][k]} * share(base) * eval_profile(base.profiles[k], r);
            }
            const double value = eval_profile(responses[m].profiles[k], r),
                         least = 1e-7 * responses[m].profiles[k].total / (kPiD * r * r);
            ASSERT_NEAR(sum, share(responses[m]) * value,
                        1.1 * kError * share(responses[m]) * std::max(value, least))
                << "material " << m << ", channel " << k << ", r " << r << ", angle " << angle;
          }
        }
  }
}

TEST(KernelSpan, IsNothingWhereItWouldBeNoFewer) {
  const auto responses = make_sweep(ProfileKind::kDipole, 40, 4);
  EXPECT_FALSE(find_span(std::span(responses).first(1), 60, 5e-4));
  EXPECT_FALSE(find_span(std::span(responses).first(16), 60, 1e-12));
  EXPECT_FALSE(find_span(make_unlike(), 60, 5e-4));
}

// One channel of members that are combinations of fewer, others of unlike ones: those take all.
TEST(KernelSpan, TakesAllMembersOfChannelsThatSpanNone) {
  auto responses = make_sweep(ProfileKind::kDipole, 10, 1.2f);
  const auto unlike = make_unlike();
  for (std::size_t m = 0; m < responses.size(); ++m) responses[m].profiles[2] = unlike[m].profiles[2];
  const auto span = find_span(responses, 60, 5e-4);
  ASSERT_TRUE(span);
  EXPECT_LT(span->counts[0], 6u);
  EXPECT_EQ(span->counts[2], 10u);
  EXPECT_EQ(span->basis.size(), 10u);
  for (std::size_t m = 0; m < responses.size(); ++m)
    for (std::size_t j = 0; j < 10; ++j) {
      EXPECT_EQ(span->weights[m][j][2], span->basis[j][2] == m ? 1.0f : 0.0f);
      EXPECT_TRUE(j < span->counts[0] || span->weights[m][j][0] == 0.0f);
    }
}

// Of what hardly scatters at all nothing is made, and others are none the worse.
TEST(KernelSpan, WeightsAreFiniteBesideMaterialsThatHardlyScatter) {
  for (const ProfileKind kind :
       {ProfileKind::kDipole, ProfileKind::kBetterDipole, ProfileKind::kNormalized}) {
    std::vector<Response> responses;
    for (const float scattering :
         {1e-20f, 1e-17f, 1e-12f, 1e-10f, 1e-8f, 1e-6f, 1e-4f, 1.0f, 1e2f, 1e3f, 0.0f}) {
      Medium medium;
      medium.profile = kind;
      medium.sigma_a = Rgb(1e4f);
      medium.sigma_s = Rgb(scattering);
      responses.push_back({resolved_profiles(medium, 0.2), {}});
    }
    const auto span = find_span(responses, 60, 5e-4);
    if (!span) continue;
    for (const auto& weights : span->weights)
      for (const auto& weight : weights)
        for (const float w : weight) EXPECT_TRUE(std::isfinite(w));
  }
}

// A channel that does not scatter, and one in which all are alike.
TEST(KernelSpan, TakesChannelsAsTheyAre) {
  auto responses = make_sweep(ProfileKind::kDipole, 20, 3);
  for (Response& response : responses) {
    response.profiles[0] = responses[0].profiles[0];
    response.profiles[1] = Profile{};
  }
  const auto span = find_span(responses, 60, 5e-4);
  ASSERT_TRUE(span);
  for (const auto& weights : span->weights) {
    float same = 0;
    for (const auto& weight : weights) {
      same += weight[0];
      EXPECT_EQ(weight[1], 0);
    }
    EXPECT_NEAR(same, 1, 1e-5);
  }
}

}  // namespace
}  // namespace nacre
