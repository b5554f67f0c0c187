// How the planes of a group's lights lie in memory, and in the file.
#pragma once

#include "nacre/cache/cache.h"

namespace nacre {

/// Points the planes of the group's lights, which have their names, into values that lie light by light:
/// irradiance by channel and sample (empty: a single light's is that of the group), errors and ratios by
/// sample (empty: not known).
inline void point_lights_into(CacheGroup& group, std::span<const float> irradiance,
                              std::span<const float> errors, std::span<const EtaRatios> ratios) {
  const std::size_t n = group.size();
  for (std::size_t l = 0; l < group.lights.size(); ++l) {
    LightPlane& light = group.lights[l];
    for (std::size_t k = 0; k < 3; ++k)
      light.irradiance[k] = irradiance.empty() ? group.planes[7 + k] : irradiance.subspan((3 * l + k) * n, n);
    light.errors = errors.empty() ? errors : errors.subspan(l * n, n);
    light.ratios = ratios.empty() ? ratios : ratios.subspan(l * n, n);
  }
}

}  // namespace nacre
