// What sampling lights needs beside the scene: made once, when a world is made.
#pragma once

#include <limits>
#include <optional>

#include "nacre/transport/environment.h"
#include "nacre/transport/light_tree.h"

namespace nacre {

inline constexpr std::size_t kNoLight = std::numeric_limits<std::size_t>::max();

struct LightTable {
  std::vector<Distribution> triangles;  // parallel to Scene::lights: those of area lights by area
  std::size_t environment = kNoLight;   // the light all around
  std::optional<Environment> map;       // if that is a map
  std::vector<std::size_t> distant;     // lights that are infinitely far away
  Distribution distant_irradiance;      // parallel to `distant`: at most, times the sampling weight
  LightTree near;                       // all other lights
};

/// Throws Error(kValue) for an area light whose shape has no area. The scene has to outlive the table
/// unchanged.
LightTable make_light_table(const Scene& scene);

}  // namespace nacre
