// Baked light for other indices of refraction, with lights dimmed or coloured.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "nacre/cache/cache.h"

namespace nacre {

/// By how much the lights of a plane (LightPlane::name) are multiplied.
struct LightScale {
  std::string name;
  Rgb scale;
};

/// Whether a group's irradiance can be had for a relative index of refraction.
bool serves_eta(const CacheGroup& group, double eta) noexcept;

/// Makes the irradiance of each group that for an index of refraction (`etas[g]`, which it has to serve),
/// with lights scaled; those that `scales` does not name stay as they are. Afterwards a group has one plane
/// of light. A group of which nothing changes is left alone, and so the numbers of a cache that is used as it
/// was baked are those of the file.
void relight(Cache& cache, std::span<const double> etas, std::span<const LightScale> scales);

/// A cache as it was baked, and what its lights are multiplied by: from it comes the irradiance for any index
/// of refraction that it serves.
struct ScaledCache {
  Cache cache;
  std::vector<LightScale> scales;

  /// The cache with each group relit, see relight(); the storage is shared where nothing changes.
  Cache relit(std::span<const double> etas) const;
  /// E_t of the samples of group `g` for an index, plane by plane: the numbers that relit() gives.
  std::array<std::vector<float>, 3> irradiance(std::size_t g, double eta) const;
};

/// Adds the planes of light of `more`, a bake of the same samples under other lights, to a cache, whose
/// fingerprint becomes that of `more`. Throws Error(kMismatch, place) where samples are not the same, or
/// either does not keep its lights apart.
void append_lights(Cache& cache, const Cache& more, const std::string& place);

/// Standard error of the mean channel of a sample's irradiance, of all lights together; 0 where none is
/// known.
float irradiance_error(const CacheGroup& group, std::size_t sample) noexcept;

}  // namespace nacre
