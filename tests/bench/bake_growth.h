// Bakes of growing size.
#pragma once

#include "bench/results.h"

namespace nacre::bench {

/// Bakes of the 50 mm bunny, of 10 k samples up to `most_samples` (10 M at most): direct light through
/// kIrradianceSamples connections to each area light.
void measure_bakes(double most_samples, int runs, Results& results);

}  // namespace nacre::bench
