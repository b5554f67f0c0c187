// What point clouds call their columns and comments.
#pragma once

#include <array>

#include "nacre/cache/cache.h"

namespace nacre {

// In the order of Plane.
inline constexpr std::array<const char*, kPlaneCount> kCloudColumns{"x",  "y",    "z",  "nx", "ny",
                                                                    "nz", "area", "er", "eg", "eb"};
inline constexpr const char* kGroupColumn = "group";

// Comments: the mark and what follows, a tab, a key, a tab, a value; groups in their order, with their areas.
inline constexpr const char *kCloudMark = "nacre", *kCloudFingerprint = "fingerprint", *kCloudInfo = "info",
                            *kCloudGroup = "group";

}  // namespace nacre
