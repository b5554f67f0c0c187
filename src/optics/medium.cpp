// Numbers that follow from a medium's coefficients and convention.
#include "nacre/optics/medium.h"

#include <limits>

#include "nacre/optics/fresnel.h"

namespace nacre {

Reduced reduce(const Medium& medium) {
  Reduced reduced;
  for (int k = 0; k < 3; ++k) {
    const double sigma_s_prime = (1.0 - medium.g[k]) * medium.sigma_s[k];
    const double sigma_t_prime = sigma_s_prime + medium.sigma_a[k];
    reduced.sigma_s_prime[k] = static_cast<float>(sigma_s_prime);
    reduced.sigma_t_prime[k] = static_cast<float>(sigma_t_prime);
    reduced.alpha_prime[k] = sigma_t_prime > 0 ? static_cast<float>(sigma_s_prime / sigma_t_prime) : 0.0f;
    reduced.sigma_tr[k] = static_cast<float>(std::sqrt(3.0 * medium.sigma_a[k] * sigma_t_prime));
    reduced.mean_free_path[k] =
        sigma_t_prime > 0 ? static_cast<float>(1.0 / sigma_t_prime) : std::numeric_limits<float>::infinity();
  }
  return reduced;
}

float exit_factor(const Medium& medium) {
  const double transmittance =
      medium.convention == Convention::kConserving ? mean_transmittance(double{medium.eta()}) : 1.0;
  return static_cast<float>(1 / (kPiD * transmittance));
}

float smallest_mean_free_path(const Medium& medium) { return min_channel(reduce(medium).mean_free_path); }

}  // namespace nacre
