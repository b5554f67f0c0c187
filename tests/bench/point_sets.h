// Points to compare samples with, and what shows how uniform points are.
#pragma once

#include <vector>

#include "bake/group_surface.h"
#include "bake/placement.h"

namespace nacre::bench {

/// Independent points, uniform by area.
std::vector<PlacedPoint> random_points(const GroupSurface& surface, std::size_t count, std::uint64_t seed);

/// Darts thrown one after the other, each kept unless one before it is nearer than 0.65 of the hexagonal
/// spacing of `count` points; ends with that many. Source: Cook 1986.
std::vector<PlacedPoint> thrown_points(const GroupSurface& surface, std::size_t count, std::uint64_t seed);

/// Radial power spectra over frequencies in units of one over the hexagonal spacing. Independent points of
/// equal weight have power 1 everywhere.
struct Spectrum {
  static constexpr std::size_t kBins = 60;
  static constexpr double kWidth = 0.04;  // of a bin
  std::vector<double> power = std::vector<double>(kBins, 0.0);
};

/// Of points in the square [-1, 1]^2 of the xy-plane, seen through a Hann window, less what their mean
/// density alone gives.
Spectrum plane_spectrum(const std::vector<PlacedPoint>& points, const std::vector<float>& weights);

/// Of points on the unit sphere: the power of spherical harmonics of degree l, which have the frequency
/// l / (2 pi).
Spectrum sphere_spectrum(const std::vector<PlacedPoint>& points, const std::vector<float>& weights);

}  // namespace nacre::bench
