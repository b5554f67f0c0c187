// The Henyey-Greenstein phase function.
#pragma once

#include <cmath>

#include "nacre/base/math.h"

namespace nacre {

/// Per steradian, normalized to 1 over the sphere; `cosine` is between the directions of propagation before
/// and after, so that g > 0 is forward. Source: Henyey & Greenstein 1941.
inline float eval_henyey_greenstein(float cosine, float g) noexcept {
  const float d = 1 + g * g - 2 * g * cosine;
  return (1 - g * g) / (4 * kPi * d * std::sqrt(d));
}

/// Cosine distributed as the phase function, for u uniform in [0, 1).
inline float sample_henyey_greenstein(float g, float u) noexcept {
  if (std::abs(g) < 1e-3f) return 1 - 2 * u;  // the inversion cancels near g = 0
  const float s = (1 - g * g) / (1 - g + 2 * g * u);
  return (1 + g * g - s * s) / (2 * g);
}

}  // namespace nacre
