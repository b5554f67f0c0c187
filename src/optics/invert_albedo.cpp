// The total reflectance of a profile, inverted for alpha'.
#include "nacre/optics/invert_albedo.h"

#include "nacre/optics/profile.h"

namespace nacre {
namespace {

// In units of the mean free path, by q = sqrt(1 - alpha'): near alpha' = 1 totals fall in proportion to q, so
// that steps of q are even where those of alpha' would be too coarse.
DiffusionCoefficients coefficients_at(double q) { return {1 - square(q), square(q)}; }

double total_at(ProfileKind profile, double q, double eta) {
  const auto [sigma_s_prime, sigma_a] = coefficients_at(q);
  switch (profile) {
    case ProfileKind::kDipole:
      return make_dipole(sigma_s_prime, sigma_a, eta).total;
    case ProfileKind::kBetterDipole:
      return make_better_dipole(sigma_s_prime, sigma_a, eta).total;
    case ProfileKind::kNormalized:
      return make_normalized_diffusion(sigma_s_prime, sigma_a, eta).total;
  }
  return 0;
}

}  // namespace

double largest_albedo(ProfileKind profile, double eta) {
  // Rounded, as 1 is meant where 0.9999999999999998 comes out.
  return std::round(total_at(profile, 0, eta) * 1e12) / 1e12;
}

DiffusionCoefficients invert_albedo(ProfileKind profile, double albedo, double mean_free_path, double eta) {
  double low = 0, high = 1;  // the total at `low` is at least `albedo`, unless rounding made it less
  constexpr int kSteps = 50;
  for (int i = 0; i < kSteps; ++i) {
    const double middle = (low + high) / 2;
    (total_at(profile, middle, eta) >= albedo ? low : high) = middle;
  }
  // The ends are met exactly: white absorbs nothing, black scatters nothing.
  const double q = albedo <= 0 ? 1 : low;
  const auto [sigma_s_prime, sigma_a] = coefficients_at(q);
  return {sigma_s_prime / mean_free_path, sigma_a / mean_free_path};
}

}  // namespace nacre
