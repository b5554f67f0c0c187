// How blotchy a sum over finitely many samples is.
#pragma once

namespace nacre {

/// Standard deviation over mean of M_o on a uniformly lit plane, from the samples' hexagonal spacing in mean
/// free paths l': what nacre's own samples and shares give (measured, marble's blue channel;
/// tests/bake/blotch_test.cpp).
double predict_blotch(double spacing) noexcept;
/// The spacing, in mean free paths, at which that blotch is reached: the inverse of predict_blotch.
double spacing_for_blotch(double blotch) noexcept;

/// Blotch that a picture does not show.
inline constexpr double kAcceptableBlotch = 0.01;

}  // namespace nacre
