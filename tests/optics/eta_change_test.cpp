// label: analytic
// Transmitted irradiance for any index from what is kept for one, against Fresnel's equations.
#include "nacre/optics/eta_change.h"

#include <gtest/gtest.h>

#include <vector>

#include "nacre/base/random.h"
#include "nacre/optics/fresnel.h"

namespace nacre {
namespace {

struct Incident {
  double cosine;
  Rgb light;
};

Rgb transmitted(const std::vector<Incident>& incident, double eta) {
  double sum[3]{};
  for (const Incident& i : incident)
    for (int k = 0; k < 3; ++k) sum[k] += (1 - fresnel_reflectance(i.cosine, eta)) * double{i.light[k]};
  return {static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2])};
}

double worst_error(const std::vector<Incident>& incident) {
  std::array<Rgb, kEtaNodes.size()> at_nodes;
  for (std::size_t j = 0; j < kEtaNodes.size(); ++j)
    at_nodes[j] = transmitted(incident, double{kEtaNodes[j]});
  const EtaRatios ratios = encode_eta_ratios(at_nodes);
  const double etas[] = {1, 1.0007, 1.004, 1.02, 1.1, 1.3, 1.45, 1.7, 1.9, 2};
  double worst = 0;
  for (const double from : etas)
    for (const double to : etas) {
      const Rgb changed = EtaChange(from, to)(transmitted(incident, from), ratios),
                exact = transmitted(incident, to);
      for (int k = 0; k < 3; ++k)
        if (exact[k] > 0)
          worst = std::max(worst, std::abs(double{changed[k]} / double{exact[k]} - 1));
        else
          EXPECT_EQ(changed[k], 0);
    }
  return worst;
}

// Light from one direction is the hardest: any other is a mixture.
TEST(EtaChange, IsRightForEveryDirection) {
  for (const double cosine : {0.05, 0.06, 0.08, 0.1, 0.15, 0.2, 0.3, 0.5, 0.7, 0.9, 1.0})
    EXPECT_LT(worst_error({{cosine, {1, 0, 0.2f}}}), 2.6e-3) << cosine;
}

TEST(EtaChange, IsRightForMixtures) {
  Rng rng(3);
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<Incident> incident;
    for (int i = 0; i < 4 + 200 * (trial % 2); ++i) {
      const double cosine = std::sqrt(rng.next_double());
      incident.push_back({cosine, {rng.next_float(), rng.next_float() * rng.next_float(), rng.next_float()}});
    }
    EXPECT_LT(worst_error(incident), 2e-3) << trial;
  }
}

TEST(EtaChange, LeavesTheSameIndexAlone) {
  const Rgb e(0.1f, 3, 0);
  EtaRatios any;
  any.fill(12345);
  EXPECT_EQ(EtaChange(1.37, 1.37)(e, any), e);
}

TEST(EtaChange, MakesSomethingFiniteOfAnyRatios) {
  Rng rng(4);
  for (int i = 0; i < 1000; ++i) {
    EtaRatios any;
    for (std::uint16_t& ratio : any) ratio = static_cast<std::uint16_t>(rng.next_bits());
    const Rgb e = EtaChange(1.2 + 0.1 * (i % 5), 1.01 + 0.2 * (i % 4))({1, 2, 3}, any);
    for (int k = 0; k < 3; ++k) EXPECT_TRUE(std::isfinite(e[k]) && e[k] >= 0);
  }
}

TEST(EtaChange, DarknessStaysDark) {
  std::array<Rgb, kEtaNodes.size()> none;
  none.fill(Rgb(0, 0, 0));
  EXPECT_EQ(encode_eta_ratios(none), EtaRatios{});
  EXPECT_EQ(EtaChange(1.3, 1.5)(Rgb(0, 0, 0), EtaRatios{}), Rgb(0, 0, 0));
}

}  // namespace
}  // namespace nacre
