// The three profiles as sums of point-source terms.
#include "nacre/optics/profile.h"

#include <fmt/format.h>

#include "nacre/optics/fresnel.h"

namespace nacre {
namespace {

struct Coefficients {
  double sigma_t_prime, alpha_prime, sigma_a;
};

// A channel that does not interact at all has an empty profile; this keeps divisions out of trouble.
bool is_empty(double sigma_s_prime) { return !(sigma_s_prime > 0); }

Coefficients combine(double sigma_s_prime, double sigma_a) {
  const double sigma_t_prime = sigma_s_prime + sigma_a;
  return {sigma_t_prime, sigma_s_prime / sigma_t_prime, sigma_a};
}

double dipole_total(double alpha_prime, double big_a) {
  const double q = std::sqrt(3 * (1 - alpha_prime));
  return alpha_prime / 2 * (1 + std::exp(-4.0 / 3.0 * big_a * q)) * std::exp(-q);
}

double boundary_factor(double eta) {
  const double f_dr = fresnel_diffuse_reflectance(eta);
  return (1 + f_dr) / (1 - f_dr);
}

}  // namespace

std::string check_eta(ProfileKind profile, double eta) {
  if (profile == ProfileKind::kBetterDipole || (eta >= kLeastDipoleEta && eta <= kLargestDipoleEta))
    return "";
  return fmt::format(
      "the profile '{}' holds for relative indices of refraction from {} to {}, not {:g}; take "
      "betterdipole",
      kProfileNames[static_cast<std::size_t>(profile)], kLeastDipoleEta, kLargestDipoleEta, eta);
}

double eval_profile(const Profile& profile, double r) noexcept {
  double sum = 0;
  for (const Profile::Term& t : profile.terms) {
    const double d = std::sqrt(r * r + t.z * t.z);
    const double inverse = 1 / d;
    sum += std::exp(-t.sigma * d) * inverse * (t.c + inverse * (t.b + inverse * t.a));
  }
  return sum;
}

ProfileValue eval_profile_derivatives(const Profile& profile, double r) noexcept {
  ProfileValue result{0, 0, 0};
  for (const Profile::Term& t : profile.terms) {
    const double d = std::sqrt(r * r + t.z * t.z);
    const double i = 1 / d;
    const double e = std::exp(-t.sigma * d);
    // f(d) and its derivatives; then the chain rule with d' = r/d and d'' = z^2/d^3.
    const double p = i * (t.c + i * (t.b + i * t.a));
    const double dp = -i * i * (t.c + i * (2 * t.b + i * 3 * t.a));
    const double ddp = i * i * i * (2 * t.c + i * (6 * t.b + i * 12 * t.a));
    const double f1 = e * (dp - t.sigma * p);
    const double f2 = e * (ddp - 2 * t.sigma * dp + t.sigma * t.sigma * p);
    result.value += e * p;
    result.slope += f1 * r * i;
    result.curvature += f2 * r * r * i * i + f1 * t.z * t.z * i * i * i;
  }
  return result;
}

Profile make_dipole(double sigma_s_prime, double sigma_a, double eta) {
  Profile profile;
  if (is_empty(sigma_s_prime)) return profile;
  const Coefficients c = combine(sigma_s_prime, sigma_a);
  const double big_a = boundary_factor(eta);
  const double sigma_tr = std::sqrt(3 * c.sigma_a * c.sigma_t_prime);
  const double z_r = 1 / c.sigma_t_prime;
  const double z_v = z_r * (1 + 4.0 / 3.0 * big_a);
  const double weight = c.alpha_prime / (4 * kPiD);
  profile.terms[0] = {z_r, sigma_tr, weight * z_r, weight * z_r * sigma_tr, 0};
  profile.terms[1] = {z_v, sigma_tr, weight * z_v, weight * z_v * sigma_tr, 0};
  profile.total = dipole_total(c.alpha_prime, big_a);
  profile.width = z_r;
  return profile;
}

Profile make_better_dipole(double sigma_s_prime, double sigma_a, double eta) {
  Profile profile;
  if (is_empty(sigma_s_prime)) return profile;
  const Coefficients c = combine(sigma_s_prime, sigma_a);
  const double big_d = (2 * sigma_a + sigma_s_prime) / (3 * square(c.sigma_t_prime));
  const double sigma_tr = std::sqrt(sigma_a / big_d);
  const FresnelMoments m = internal_fresnel_moments(eta);
  const double c_phi = (1 - 2 * m.c1) / 4;
  const double c_e = (1 - 3 * m.c2) / 2;
  const double big_a = (1 + 3 * m.c2) / (1 - 2 * m.c1);
  const double z_r = 1 / c.sigma_t_prime;
  const double z_v = -z_r - 4 * big_a * big_d;
  const double weight = square(c.alpha_prime) / (4 * kPiD);
  profile.terms[0] = {z_r, sigma_tr, weight * c_e * z_r, weight * c_e * z_r * sigma_tr,
                      weight * c_phi / big_d};
  profile.terms[1] = {-z_v, sigma_tr, -weight * c_e * z_v, -weight * c_e * z_v * sigma_tr,
                      -weight * c_phi / big_d};
  // (1 - exp(-x)) / (D sigma_tr) with x = 4 A D sigma_tr tends to 4 A without absorption.
  const double x = 4 * big_a * big_d * sigma_tr;
  const double flux = x > 0 ? -std::expm1(-x) / (big_d * sigma_tr) : 4 * big_a;
  profile.total =
      square(c.alpha_prime) / 2 * std::exp(-sigma_tr * z_r) * (c_e * (1 + std::exp(-x)) + c_phi * flux);
  profile.width = z_r;
  return profile;
}

Profile make_normalized_diffusion(double sigma_s_prime, double sigma_a, double eta) {
  Profile profile;
  if (is_empty(sigma_s_prime)) return profile;
  const Coefficients c = combine(sigma_s_prime, sigma_a);
  const double albedo = dipole_total(c.alpha_prime, boundary_factor(eta));
  const double l = 1 / c.sigma_t_prime;
  const double s = 1.85 - albedo + 7 * std::pow(std::abs(albedo - 0.8), 3);
  const double weight = albedo * s / (8 * kPiD * l);
  profile.terms[0] = {0, s / l, 0, 0, weight};
  profile.terms[1] = {0, s / (3 * l), 0, 0, weight};
  profile.total = albedo;
  profile.width = l / s;
  return profile;
}

// A source w exp(-sigma r)/r is moved to the height h, where its integral over the plane is exp(-sigma h)
// times what it was. The rest is laid down as the flux of a source at that height, exp(-sigma d) (h/d^3 +
// sigma h/d^2), whose integral is 2 pi exp(-sigma h). Where absorption is strong both are Gaussians of
// variance h/sigma, which is not to fall below what samples can show.
Profile resolve_profile(const Profile& profile, double spacing) {
  if (!profile.singular() || !(profile.total > 0)) return profile;
  // In spacings: blotch is about that of a dipole, and what a blur of that width takes from detail is less
  // than samples lose anyway.
  constexpr double kHeight = 1.4, kVariance = 0.3;
  constexpr double kSteepest = 500;  // sigma h, for the range of exponents
  spacing = std::clamp(spacing, 1e-6 * profile.width, 1e6 * profile.width);
  Profile resolved = profile;
  resolved.width = 1e300;
  for (Profile::Term& t : resolved.terms) {
    const double h = std::min(spacing * (kHeight + kVariance * t.sigma * spacing), kSteepest / t.sigma);
    const double rest = t.c * std::expm1(t.sigma * h) / t.sigma;
    t = {h, t.sigma, rest * h, rest * t.sigma * h, t.c};
    resolved.width = std::min(resolved.width, h);
  }
  return resolved;
}

std::array<Profile, 3> make_profiles(const Medium& medium) {
  std::array<Profile, 3> profiles;
  for (int k = 0; k < 3; ++k) {
    const double sigma_s_prime = (1.0 - medium.g[k]) * medium.sigma_s[k] * medium.scale;
    const double sigma_a = static_cast<double>(medium.sigma_a[k]) * medium.scale;
    const double eta = medium.eta();
    auto& profile = profiles[static_cast<std::size_t>(k)];
    switch (medium.profile) {
      case ProfileKind::kDipole:
        profile = make_dipole(sigma_s_prime, sigma_a, eta);
        break;
      case ProfileKind::kBetterDipole:
        profile = make_better_dipole(sigma_s_prime, sigma_a, eta);
        break;
      case ProfileKind::kNormalized:
        profile = make_normalized_diffusion(sigma_s_prime, sigma_a, eta);
        break;
    }
  }
  return profiles;
}

std::array<Profile, 3> resolved_profiles(const Medium& medium, double spacing) {
  const double finest = kFinestSpacing * double{smallest_mean_free_path(medium)} / double{medium.scale};
  std::array<Profile, 3> profiles = make_profiles(medium);
  for (Profile& profile : profiles) profile = resolve_profile(profile, std::max(spacing, finest));
  return profiles;
}

}  // namespace nacre
