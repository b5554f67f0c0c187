// Angular means of the Fresnel equations.
#include "nacre/optics/fresnel.h"

#include <array>

namespace nacre {
namespace {

// integral of f over [a, b] where f has a square-root singularity in its slope at a: mu = a + (b - a) t^2
// makes it smooth; then composite 5-point Gauss-Legendre.
template <class F>
double integrate_from_root(double a, double b, const F& f) {
  constexpr std::array<double, 5> kNode{0, -0.538469310105683091, 0.538469310105683091, -0.906179845938663993,
                                        0.906179845938663993};
  constexpr std::array<double, 5> kWeight{0.568888888888888889, 0.478628670499366468, 0.478628670499366468,
                                          0.236926885056189088, 0.236926885056189088};
  constexpr int kPanels = 64;
  double sum = 0;
  for (int panel = 0; panel < kPanels; ++panel)
    for (std::size_t k = 0; k < kNode.size(); ++k) {
      const double t = (panel + 0.5 * (1 + kNode[k])) / kPanels;
      sum += kWeight[k] * f(a + (b - a) * t * t) * 2 * t;
    }
  return sum * (b - a) / (2 * kPanels);
}

}  // namespace

float fresnel_conductor(float cos_i, float eta, float k) noexcept {
  const float cos2 = cos_i * cos_i, sin2 = 1 - cos2;
  const float real = eta * eta - k * k - sin2;
  const float a2_b2 = std::sqrt(real * real + square(2 * eta * k));
  const float a = std::sqrt(std::max(0.0f, (a2_b2 + real) / 2));
  const float r_s_sum = a2_b2 + cos2, r_s_mixed = 2 * cos_i * a;
  const float r_p_sum = cos2 * a2_b2 + sin2 * sin2, r_p_mixed = r_s_mixed * sin2;
  if (!(r_s_sum + r_s_mixed > 0) || !(r_p_sum + r_p_mixed > 0)) return 1;
  const float r_s = (r_s_sum - r_s_mixed) / (r_s_sum + r_s_mixed);
  const float r_p = r_s * (r_p_sum - r_p_mixed) / (r_p_sum + r_p_mixed);
  return std::clamp((r_s + r_p) / 2, 0.0f, 1.0f);
}

double fresnel_diffuse_reflectance(double eta) noexcept {
  const double inverse = 1 / eta;
  if (eta >= 1) return (-1.440 * inverse + 0.710) * inverse + 0.668 + 0.0636 * eta;
  return -0.4399 + inverse * (0.7099 + inverse * (-0.3319 + inverse * 0.0636));
}

double mean_transmittance(double eta) noexcept {
  // Nothing enters below the critical angle of a thinner medium.
  const double mu_critical = eta < 1 ? std::sqrt(1 - eta * eta) : 0;
  return 2 * integrate_from_root(mu_critical, 1,
                                 [&](double mu) { return (1 - fresnel_reflectance(mu, eta)) * mu; });
}

FresnelMoments internal_fresnel_moments(double eta) noexcept {
  const double inverse = 1 / eta;
  const double mu_critical = eta > 1 ? std::sqrt(1 - inverse * inverse) : 0;
  FresnelMoments moments{square(mu_critical) / 2, mu_critical * square(mu_critical) / 3};  // total reflection
  moments.c1 +=
      integrate_from_root(mu_critical, 1, [&](double mu) { return fresnel_reflectance(mu, inverse) * mu; });
  moments.c2 += integrate_from_root(mu_critical, 1,
                                    [&](double mu) { return fresnel_reflectance(mu, inverse) * mu * mu; });
  return moments;
}

}  // namespace nacre
