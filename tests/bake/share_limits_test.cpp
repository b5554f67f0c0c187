// label: analytic
// What samples stand for where the surface turns away from them.
#include "bake/share_limits.h"

#include <gtest/gtest.h>

#include <numeric>

#include "bake/surfaces.h"

namespace nacre {
namespace {

using namespace testing_support;

double sum(const std::vector<float>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

TEST(ShareLimits, OneSampleHasNoMoreThanItsSurface) {
  const GroupSurface surface = make_surface({placed(make_cube(), 1, {4, 0, 0}), make_sphere()});
  const auto points = place(surface, 1000);
  const std::vector<float> even = share(surface, points);
  const double mean = surface.areas.total() / static_cast<double>(points.size());
  for (std::size_t i = 0; i < points.size(); i += 97) {
    std::vector<float> shares = even;
    shares[i] *= 10;
    limit_shares(surface, points, shares);
    EXPECT_GT(shares[i], double{even[i]});
    EXPECT_LT(shares[i], 2 * double{even[i]} + 0.5 * mean) << i;
    // The rest is the piece's, so that its sum stays, and the other pieces' shares do.
    EXPECT_NEAR(sum(shares) / (sum(even) + 9 * double{even[i]}), 1, 1e-5);
    for (std::size_t j = 0; j < points.size(); ++j)
      if (surface.components[points[j].triangle] != surface.components[points[i].triangle]) {
        EXPECT_EQ(shares[j], even[j]);
      }
  }
}

// Shares of even samples stay as they are, to the bit.
TEST(ShareLimits, EvenSamplesKeepTheirs) {
  for (const GroupSurface& surface : {make_surface({make_rectangle()}), make_surface({make_sphere()}),
                                      make_surface({make_cube()}), make_surface({make_sliver_plane(4000)})}) {
    const auto points = place(surface, 3000);
    const std::vector<float> shares = share(surface, points);
    std::vector<float> limited = shares;
    limit_shares(surface, points, limited);
    EXPECT_EQ(limited, shares);
  }
}

// A comb of teeth that are finer than samples are apart: every tooth's tip turns within less than a spacing.
TEST(ShareLimits, NoSampleOfACombStandsForManyTeeth) {
  Mesh comb;
  const Mesh tooth = placed(make_sphere(), Vec3(0.02f, 0.3f, 0.3f), {0, 0, 0});
  for (int i = 0; i < 12; ++i) {
    const auto base = static_cast<std::uint32_t>(comb.positions.size());
    for (const Vec3& p : tooth.positions)
      comb.positions.push_back(p + Vec3(0.08f * static_cast<float>(i), 0, 0));
    for (const Triangle& t : tooth.triangles)
      comb.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
  }
  const GroupSurface surface = make_surface({comb});
  const auto points = place(surface, 600);
  std::vector<float> shares = share(surface, points);
  const double mean = surface.areas.total() / static_cast<double>(points.size());
  const auto excess = [&](const std::vector<float>& of) {
    double result = 0;
    for (const float a : of) result += std::max(double{a} - 2.5 * mean, 0.0);
    return result / surface.areas.total();
  };
  std::vector<float> limited = shares;
  limit_shares(surface, points, limited);
  EXPECT_NEAR(sum(limited) / surface.areas.total(), 1, 1e-4);
  EXPECT_GT(excess(shares), 0.01);
  EXPECT_LE(excess(limited), 0.1 * excess(shares));
}

}  // namespace
}  // namespace nacre
