// One random scene through the whole of nacre, and what has to hold of it.
#pragma once

#include <cstdint>
#include <string>

namespace nacre::soak {

struct Trial {
  std::string refusal;    // the error of a scene that is none, in one line
  std::string violation;  // of what nacre promises
  std::string options;    // of `nacre bake` and `nacre render` that do the same
  bool certified = false;
  double tolerance = 0;
  std::size_t samples = 0, points = 0;    // of the cache; compared with the exact sum
  double relative_rmse = 0, largest = 0;  // at those points
};

/// Makes the scene of a seed in `folder`, bakes, saves, reads and renders it, and checks: nothing but the
/// scene or its options is refused, in one line; the cache and the picture are what was saved; every pixel is
/// finite and not negative; the error against the exact sum is at most the tolerance, in every channel of
/// every point if certified, and as a relative RMSE otherwise; one thread and a crop give the same bits.
Trial run_trial(std::uint64_t seed, const std::string& folder);

}  // namespace nacre::soak
