// label: analytic
// Few kernels for many materials: how near their combinations come, and when there are none.
#include "cache/kernel_span.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "cache/sample_sets.h"

namespace nacre {
namespace {

using namespace testing_support;

std::vector<std::array<Profile, 3>> make_sweep(ProfileKind kind, int count, float most) {
  std::vector<std::array<Profile, 3>> profiles;
  for (int i = 0; i < count; ++i) {
    Medium medium = make_material("Marble", kind, 1);
    medium.sigma_a *= 1 + (most - 1) * static_cast<float>(i) / static_cast<float>(count - 1);
    profiles.push_back(resolved_profiles(medium, 0.2));
  }
  return profiles;
}

class EveryKind : public testing::TestWithParam<ProfileKind> {};
INSTANTIATE_TEST_SUITE_P(Kinds, EveryKind,
                         testing::Values(ProfileKind::kDipole, ProfileKind::kBetterDipole,
                                         ProfileKind::kNormalized));

// At distances that are none of those it was made from.
TEST_P(EveryKind, CombinationsAreAsNearAsAsked) {
  constexpr double kFarthest = 60, kError = 5e-4;
  const auto profiles = make_sweep(GetParam(), 40, 4);
  const auto span = find_span(profiles, kFarthest, kError, 8);
  ASSERT_TRUE(span);
  EXPECT_LE(span->basis.size(), 16u);
  EXPECT_EQ(span->basis.size() % 8, 0u);
  for (std::size_t m = 0; m < profiles.size(); ++m)
    for (std::size_t k = 0; k < 3; ++k)
      for (double r = 0.0011; r < kFarthest; r *= 1.037) {
        double sum = 0;
        for (std::size_t j = 0; j < span->basis.size(); ++j)
          sum += double{span->weights[m][j][k]} * eval_profile(profiles[span->basis[j][k]][k], r);
        const double value = eval_profile(profiles[m][k], r);
        ASSERT_NEAR(sum, value, 1.1 * kError * std::max(value, 1e-7 * profiles[m][k].total / (kPiD * r * r)))
            << "material " << m << ", channel " << k << ", r " << r;
      }
}

TEST(KernelSpan, IsNothingWhereItWouldBeNoFewer) {
  const auto profiles = make_sweep(ProfileKind::kDipole, 40, 4);
  EXPECT_FALSE(find_span(std::span(profiles).first(8), 60, 5e-4, 8));
  EXPECT_FALSE(find_span(std::span(profiles).first(16), 60, 1e-12, 8));
  EXPECT_FALSE(find_span(make_sweep(ProfileKind::kDipole, 16, 1e4), 60, 5e-4, 8));
}

// A channel that does not scatter, and one in which all are alike.
TEST(KernelSpan, TakesChannelsAsTheyAre) {
  auto profiles = make_sweep(ProfileKind::kDipole, 20, 3);
  for (auto& channels : profiles) {
    channels[0] = profiles[0][0];
    channels[1] = Profile{};
  }
  const auto span = find_span(profiles, 60, 5e-4, 8);
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
