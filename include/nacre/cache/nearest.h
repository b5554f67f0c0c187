// The sample of a group that is nearest to a point.
#pragma once

#include "nacre/cache/cache.h"

namespace nacre {

/// Index of the sample nearest to `position` among those whose normals are not turned away from `normal`
/// (unit length), or among all if there is none; the group has at least one. By a descent of the octree.
std::size_t find_nearest_sample(const CacheGroup& group, const Vec3& position, const Vec3& normal) noexcept;

}  // namespace nacre
