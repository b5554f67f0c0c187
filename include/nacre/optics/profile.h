// Diffusion profiles: how much of the light that enters at one point leaves at another, by distance.
#pragma once

#include <algorithm>
#include <array>
#include <string>

#include "nacre/optics/medium.h"

namespace nacre {

/// One channel of a profile, R(r) per unit area, decreasing in r. Every profile that nacre knows is a sum of
/// two terms exp(-sigma d) (a/d^3 + b/d^2 + c/d), d = sqrt(r^2 + z^2), so that all evaluators take any of
/// them. Lengths are in whatever unit the coefficients were given in.
struct Profile {
  struct Term {
    double z = 1, sigma = 0, a = 0, b = 0, c = 0;
  };
  std::array<Term, 2> terms;
  double total = 0;  // integral of R over the plane: diffuse reflectance of a half-space
  double width = 1;  // length over which R changes near r = 0: z_r, or l / s for a profile singular there

  /// How fast R falls far away, per scene unit: the slower of its exponentials.
  double decay() const { return std::min(terms[0].sigma, terms[1].sigma); }
  /// True if R grows like 1/r at 0, where no sum over samples can follow it: see resolve_profile.
  bool singular() const { return terms[0].z == 0; }
};

/// R, R' and R'' at distance r > 0 (r = 0 as well unless singular).
struct ProfileValue {
  double value, slope, curvature;
};
double eval_profile(const Profile& profile, double r) noexcept;
ProfileValue eval_profile_derivatives(const Profile& profile, double r) noexcept;

/// Classic dipole. Source: Jensen et al. 2001 with the corrected extrapolation (both terms dimensionally
/// sound).
Profile make_dipole(double sigma_s_prime, double sigma_a, double eta);
/// Dipole of improved diffusion theory with exact Fresnel moments. Source: d'Eon 2012.
Profile make_better_dipole(double sigma_s_prime, double sigma_a, double eta);
/// Normalized diffusion, searchlight form, albedo = the dipole's total and l = 1/sigma_t'. It contains single
/// scattering. Source: Christensen & Burley 2015.
Profile make_normalized_diffusion(double sigma_s_prime, double sigma_a, double eta);

/// The profile as samples `spacing` apart can carry it. One that is singular is bounded by moving its source
/// off the surface by about that distance; what that takes from its total is given back nearby. The total is
/// kept, what is further away than a few spacings changes in second order, and the sum over samples is smooth
/// however far they are apart. Other profiles are left alone.
Profile resolve_profile(const Profile& profile, double spacing);

/// Relative indices of refraction that the fit of the diffuse Fresnel reflectance, and with it the dipole and
/// normalized diffusion, hold for: it passes 1 at 0.26 and 3.9.
inline constexpr double kLeastDipoleEta = 0.3, kLargestDipoleEta = 3.5;
/// "" or what is wrong with a profile for that relative index.
std::string check_eta(ProfileKind profile, double eta);

/// The medium's own profile, r, g, b, in scene units (coefficients times scale).
std::array<Profile, 3> make_profiles(const Medium& medium);
/// The same as samples carry it (resolve_profile): not finer than kFinestSpacing smallest mean free paths,
/// which is what exitance is interpolated by.
std::array<Profile, 3> resolved_profiles(const Medium& medium, double spacing);
inline constexpr double kFinestSpacing = 0.5;

}  // namespace nacre
