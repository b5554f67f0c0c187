// Statistical tests for samplers.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

namespace nacre::testing_support {

/// Upper tail probability of a chi-square statistic, by the Wilson-Hilferty approximation (good to 1e-3 for
/// the degrees of freedom used here).
inline double chi_square_tail(double statistic, double degrees) {
  const double z = (std::cbrt(statistic / degrees) - (1 - 2 / (9 * degrees))) / std::sqrt(2 / (9 * degrees));
  return 0.5 * std::erfc(z / std::sqrt(2.0));
}

/// p-value of counts against expected counts; cells that expect fewer than five are pooled.
inline double chi_square_p(const std::vector<double>& counts, const std::vector<double>& expected) {
  double statistic = 0, pooled_count = 0, pooled_expected = 0;
  int cells = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (expected[i] < 5) {
      pooled_count += counts[i];
      pooled_expected += expected[i];
      continue;
    }
    statistic += (counts[i] - expected[i]) * (counts[i] - expected[i]) / expected[i];
    ++cells;
  }
  if (pooled_expected > 0) {
    statistic += (pooled_count - pooled_expected) * (pooled_count - pooled_expected) / pooled_expected;
    ++cells;
  } else if (pooled_count > 0) {
    return 0;  // something fell where nothing may
  }
  return chi_square_tail(statistic, cells - 1);
}

}  // namespace nacre::testing_support
