// How even a sum over samples is where light is.
#pragma once

#include <cmath>
#include <vector>

#include "nacre/cache/exitance.h"
#include "nacre/cache/octree.h"

namespace nacre::testing_support {

struct Evenness {
  double mean = 0;    // M_o over E_t
  double blotch = 0;  // standard deviation over mean
};

/// M_o at `probes` in one channel, summed over every one of the samples, with E_t = 1 at each.
inline Evenness measure_evenness(SurfaceSamples samples, double surface_area, const Medium& medium,
                                 const std::vector<Vec3>& probes, int channel) {
  samples.irradiance.assign(samples.positions.size(), Rgb(1, 1, 1));
  std::vector<std::shared_ptr<const void>> storage;
  const CacheGroup group = build_group("test", surface_area, samples, storage);
  const Exitance exitance(group, medium, 0);
  std::uint64_t evaluations = 0;
  std::vector<Rgb> values(probes.size());
  exitance.eval_exact(probes, values, evaluations);
  double sum = 0, sum2 = 0;
  for (const Rgb& rgb : values) {
    const double value = static_cast<double>(rgb[channel]);
    sum += value;
    sum2 += value * value;
  }
  const double count = static_cast<double>(probes.size()), mean = sum / count;
  return {mean, std::sqrt(std::max(sum2 / count - mean * mean, 0.0)) / mean};
}

}  // namespace nacre::testing_support
