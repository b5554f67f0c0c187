// Coefficients from the colour that a material is to have.
#pragma once

#include "nacre/optics/medium.h"

namespace nacre {

/// What diffusion needs of one channel, in 1/(unit of the mean free path).
struct DiffusionCoefficients {
  double sigma_s_prime, sigma_a;
};

/// Total diffuse reflectance (Profile::total) of a half-space that does not absorb: no larger one exists.
double largest_albedo(ProfileKind profile, double eta);

/// The coefficients whose profile has the total diffuse reflectance `albedo`, in [0, largest_albedo], and the
/// mean free path 1/sigma_t' = `mean_free_path` > 0; exact to 1e-9 in the total. The total depends on
/// alpha' = sigma_s'/sigma_t' alone and grows with it: solved by bisection.
DiffusionCoefficients invert_albedo(ProfileKind profile, double albedo, double mean_free_path, double eta);

}  // namespace nacre
