// A power law through measurements.
#include "nacre/cache/blotch.h"

#include <cmath>

namespace nacre {
namespace {

// Least squares in log-log over spacings 0.4 to 1.4 (tests/bake/blotch_test.cpp measures it again).
constexpr double kAtUnitSpacing = 0.0084;
constexpr double kExponent = 3.5;

}  // namespace

double predict_blotch(double spacing) noexcept { return kAtUnitSpacing * std::pow(spacing, kExponent); }
double spacing_for_blotch(double blotch) noexcept { return std::pow(blotch / kAtUnitSpacing, 1 / kExponent); }

}  // namespace nacre
