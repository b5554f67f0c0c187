// How time and memory grow with the cache and with the picture.
#pragma once

#include "bench/results.h"

namespace nacre::bench {

/// First frames of a 50 mm bunny: 512 x 512 pixels from 20 k samples up to `most_samples` (10 M at most), and
/// 200 k samples from 512 x 512 pixels to `most_pixels` squared.
void measure_growth(double most_samples, int most_pixels, int runs, Results& results);

}  // namespace nacre::bench
