// Dielectric boundaries: reflectance, refraction, and the means over angles that diffusion uses.
#pragma once

#include <cmath>

#include "nacre/base/math.h"

namespace nacre {

/// Unpolarized reflectance F_r of a smooth boundary for light that arrives at angle acos(cos_i), cos_i in [0,
/// 1]; eta = n_transmitted / n_incident. 1 under total internal reflection. F_t is 1 - F_r.
template <class Real>
Real fresnel_reflectance(Real cos_i, Real eta) noexcept {
  const Real sin2_t = (1 - cos_i * cos_i) / (eta * eta);
  if (sin2_t >= 1) return 1;
  const Real cos_t = std::sqrt(1 - sin2_t);
  const Real r_s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
  const Real r_p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
  return (r_s * r_s + r_p * r_p) / 2;
}

/// Unpolarized reflectance of a smooth conductor of complex index eta + i k, both relative to the medium
/// outside, for cos_i in [0, 1]. 1 for eta = 0, the perfect mirror. Source: Born & Wolf 1999, section 14.2.
float fresnel_conductor(float cos_i, float eta, float k) noexcept;

/// Diffuse reflectance F_dr by the polynomial fit of Egan and Hilgeman 1973; eta = n_inside / n_outside.
double fresnel_diffuse_reflectance(double eta) noexcept;

/// Mean external transmittance T = 2 integral_0^1 F_t(mu) mu dmu, by quadrature to 1e-9.
double mean_transmittance(double eta) noexcept;

/// First and second angular moments of the internal reflectance: C1 = integral_0^1 F_r(mu) mu dmu and
/// C2 = integral_0^1 F_r(mu) mu^2 dmu for light inside. Source: d'Eon 2012.
struct FresnelMoments {
  double c1, c2;
};
FresnelMoments internal_fresnel_moments(double eta) noexcept;

/// `direction` mirrored at a surface of unit normal n; both point away from the surface.
inline Vec3 reflect(const Vec3& direction, const Vec3& n) noexcept {
  return n * (2 * dot(direction, n)) - direction;
}

/// Direction of the transmitted ray, away from the surface on the other side, for `direction` pointing away
/// from the surface on the side of n (dot > 0); eta = n_transmitted / n_incident. False under total internal
/// reflection.
inline bool refract(const Vec3& direction, const Vec3& n, float eta, Vec3& transmitted) noexcept {
  const float cos_i = dot(direction, n);
  const float sin2_t = (1 - cos_i * cos_i) / (eta * eta);
  if (sin2_t >= 1) return false;
  transmitted = n * (cos_i / eta - std::sqrt(1 - sin2_t)) - direction / eta;
  return true;
}

}  // namespace nacre
