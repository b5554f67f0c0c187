// label: analytic
// The table against the closed form, and its bounds against the derivatives.
#include "nacre/cache/kernel.h"

#include <gtest/gtest.h>

#include "cache/local_expansion.h"
#include "cache/sample_sets.h"
#include "nacre/base/sampling.h"

namespace nacre {
namespace {

using testing_support::make_material;

struct Case {
  const char* preset;
  ProfileKind kind;
};
std::ostream& operator<<(std::ostream& out, const Case& c) {
  return out << c.preset << " " << static_cast<int>(c.kind);
}

class EveryKernel : public testing::TestWithParam<Case> {
 protected:
  std::array<Profile, 3> profiles_ =
      resolved_profiles(make_material(GetParam().preset, GetParam().kind, 1), 0.2);
  Kernel kernel_{profiles_};

  double start() const {
    double narrowest = 1e30;
    for (const Profile& p : profiles_) narrowest = std::min(narrowest, p.width);
    return narrowest * 0x1p-10;
  }
  static double largest_sigma(const Profile& p) { return std::max(p.terms[0].sigma, p.terms[1].sigma); }
};
std::vector<Case> cases() {
  std::vector<Case> all;
  for (const char* preset : {"Marble", "Spectralon", "Skin1", "Ketchup"})
    for (const auto kind : {ProfileKind::kDipole, ProfileKind::kBetterDipole, ProfileKind::kNormalized})
      all.push_back({preset, kind});
  return all;
}
INSTANTIATE_TEST_SUITE_P(Materials, EveryKernel, testing::ValuesIn(cases()));

// Distances from the start of the table to where 15 decay lengths or 1e5 widths are reached.
TEST_P(EveryKernel, TableIsAsAccurateAsDocumented) {
  Rng rng(1);
  for (int k = 0; k < 3; ++k) {
    const Profile& p = profiles_[static_cast<std::size_t>(k)];
    const double sigma = largest_sigma(p);
    const double end = sigma > 0 ? std::min(15 / sigma, 1e5 * p.width) : 1e5 * p.width;
    double worst_near = 0, worst_far = 0;
    for (int i = 0; i < 200000; ++i) {
      const double r = start() * std::pow(end / start(), rng.next_double());
      const auto r2 = static_cast<float>(r * r);
      const double exact = eval_profile(p, std::sqrt(static_cast<double>(r2)));
      const double error = std::abs(static_cast<double>(kernel_.eval(r2)[k]) / exact - 1);
      double& worst = sigma * r < 1 ? worst_near : worst_far;
      worst = std::max(worst, error);
    }
    EXPECT_LT(worst_near, 8e-6) << k;
    EXPECT_LT(worst_far, 1.5e-4) << k;
  }
}

TEST_P(EveryKernel, IsFiniteAndDecreasesFromCentreToBeyondTheEnd) {
  for (int k = 0; k < 3; ++k) {
    float previous = kernel_.eval(0)[k];
    EXPECT_TRUE(std::isfinite(previous));
    EXPECT_GT(previous, 0);
    for (double r = 0.5 * start(); r < 1e15; r *= 1.013) {
      const float value = kernel_.eval(static_cast<float>(r * r))[k];
      ASSERT_TRUE(value >= 0 && value <= previous * (1 + 1e-6f)) << r << ": " << value << " " << previous;
      previous = value;
    }
    EXPECT_EQ(kernel_.eval(std::numeric_limits<float>::infinity())[k], 0);
    EXPECT_EQ(kernel_.eval(std::numeric_limits<float>::max())[k], 0);
  }
}

TEST_P(EveryKernel, BoundsHoldEverywhereBeyondAndAreMonotone) {
  Rng rng(2);
  for (int k = 0; k < 3; ++k) {
    const Profile& p = profiles_[static_cast<std::size_t>(k)];
    const double first = 0.01 * start();
    for (int i = 0; i < 100000; ++i) {
      const double near = first * std::pow(1e8, rng.next_double());
      // Half of the time right at the cell, where the bound is tightest; else anywhere beyond.
      const double r = i % 2 ? near : near * std::pow(1e4, rng.next_double());
      const Kernel::Bounds& bounds = kernel_.bounds(static_cast<float>(near * near));
      const ProfileValue v = eval_profile_derivatives(p, r * (1 + 1e-7));
      // Below the least float the table says 0, and so may its bounds.
      ASSERT_LE(std::abs(v.slope) * (1 - 1e-6) - 1e-45, static_cast<double>(bounds.slope[k]))
          << near << " " << r;
      ASSERT_LE(std::max(std::abs(v.curvature), std::abs(v.slope) / r) * (1 - 1e-6) - 1e-45,
                static_cast<double>(bounds.hessian[k]))
          << near << " " << r;
    }
    Kernel::Bounds previous = kernel_.bounds(0);
    for (double r = 0.5 * start(); r < 1e10; r *= 1.01) {
      const Kernel::Bounds& b = kernel_.bounds(static_cast<float>(r * r));
      ASSERT_LE(b.slope[k], previous.slope[k]) << r;
      ASSERT_LE(b.hessian[k], previous.hessian[k]) << r;
      previous = b;
    }
  }
}

// A Taylor series of R(|x|) about a point errs by no more than the bound on third derivatives says, wherever
// it is evaluated; moved elsewhere it is the same function.
TEST_P(EveryKernel, SeriesErrNoMoreThanTheirBound) {
  Rng rng(7);
  const auto random_direction = [&] { return sample_uniform_sphere(rng.next_2d()); };
  for (int i = 0; i < 20000; ++i) {
    const double width = profiles_[static_cast<std::size_t>(i % 3)].width;
    const auto distance = static_cast<float>(width * std::pow(100, rng.next_double() - 0.2));
    const float radius = 0.5f * distance * rng.next_float();
    const Vec3 offset = random_direction() * distance, at = random_direction() * radius,
               moved = random_direction() * radius;
    LocalExpansion series;
    series.add(broadcast(2), kernel_.eval_jet(dot(offset, offset)), offset);
    const Float4 value = series.eval(at), again = series.moved(moved).eval(at - moved);
    const Kernel::Bounds& bounds = kernel_.bounds(square(distance - radius));
    for (int k = 0; k < 3; ++k) {
      // Further out an octave is many decay lengths.
      if (largest_sigma(profiles_[static_cast<std::size_t>(k)]) * double{distance} > 15) continue;
      const double exact =
          2 * eval_profile(profiles_[static_cast<std::size_t>(k)], double{(offset + at).length()});
      const double scale =
          2 * eval_profile(profiles_[static_cast<std::size_t>(k)], double{distance - radius});
      const double bound = 2 * double{bounds.third[k]} * std::pow(double{radius}, 3) / 6;
      // Tables of derivatives are linear between 64 entries an octave, and floats are floats.
      ASSERT_LE(std::abs(double{value[k]} - exact), bound + 2e-3 * scale) << distance << " " << radius;
      ASSERT_NEAR(value[k], again[k], 1e-4 * scale) << distance << " " << radius;
    }
  }
}

// The table is not that loose either: at worst the maximum of the next cell, 2 % above.
TEST_P(EveryKernel, BoundsAreTightWhereTheProfileDecays) {
  for (int k = 0; k < 3; ++k) {
    const Profile& p = profiles_[static_cast<std::size_t>(k)];
    // Where sigma r is larger, R falls by more than that within a cell.
    for (double r = 3 * p.width; r < 30 * p.width && largest_sigma(p) * r < 5; r *= 1.1) {
      const ProfileValue v = eval_profile_derivatives(p, r);
      const double hessian = std::max(std::abs(v.curvature), std::abs(v.slope) / r);
      const auto& bounds = kernel_.bounds(static_cast<float>(r * r));
      EXPECT_LT(static_cast<double>(bounds.slope[k]), 1.6 * std::abs(v.slope)) << r;
      EXPECT_LT(static_cast<double>(bounds.hessian[k]), 1.6 * hessian) << r;
    }
  }
}

// Channels that do not scatter have no profile; all of them black is a kernel as well.
TEST(Kernel, OfNothingIsZero) {
  const Kernel kernel({Profile{}, Profile{}, Profile{}});
  for (const float r2 : {0.0f, 1e-9f, 1.0f, 1e9f})
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(kernel.eval(r2)[k], 0);
      EXPECT_EQ(kernel.bounds(r2).slope[k], 0);
    }
}

TEST(Kernel, KeepsABlackChannelBlackBesideOthers) {
  const Kernel kernel({make_dipole(2, 0.01, 1.5), Profile{}, make_dipole(2, 0.01, 1.5)});
  EXPECT_GT(kernel.eval(1)[0], 0);
  EXPECT_EQ(kernel.eval(1)[1], 0);
  EXPECT_EQ(kernel.eval(1)[0], kernel.eval(1)[2]);
}

}  // namespace
}  // namespace nacre
