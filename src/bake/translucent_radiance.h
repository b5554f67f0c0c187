// What translucent objects send to others while a bake is under way.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "nacre/base/progress.h"
#include "nacre/cache/cache.h"
#include "nacre/transport/world.h"

namespace nacre {

/// Radiance by diffusion from the surface of translucent shapes, at the exitance of the nearest sample: far
/// cruder than a picture's, but it only lights other samples, over the whole hemisphere.
class TranslucentRadiance {
 public:
  /// Evaluates the exitance at every sample. World and groups, parallel to Scene::media, have to outlive it.
  TranslucentRadiance(const World& world, std::span<const CacheGroup> groups, Progress& progress);
  Rgb operator()(const Hit& hit, const Vec3& out) const;

 private:
  struct Group {
    std::vector<Rgb> exitance;  // by sample
    float exit_factor;
  };
  const World& world_;
  std::span<const CacheGroup> cache_;
  std::vector<Group> groups_;
};

}  // namespace nacre
