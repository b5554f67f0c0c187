// Building the octree over a group's samples.
#pragma once

#include <string>

#include "nacre/cache/cache.h"

namespace nacre {

/// Which of these positions comes i-th along the Morton curve over them. Samples that are in this order stay
/// as they are in build_group, which then needs less memory.
std::vector<std::uint32_t> octree_order(std::span<const Vec3> positions);

/// Sorts samples along a Morton curve and builds the octree over them; at most kMaxLeafSamples per leaf
/// except where that many share one cell of the finest level. Vectors of `samples` are given back as soon as
/// they are sorted. The group owns its data through `storage`, which is added to. The result depends on the
/// samples alone. Throws Error(kLimit) above kMaxSamplesPerGroup.
CacheGroup build_group(std::string name, double surface_area, SurfaceSamples samples,
                       std::vector<std::shared_ptr<const void>>& storage);

/// Sums up over the samples of each node, whose ranges and children are known, what depends on irradiance.
void sum_nodes(const CacheGroup& group, std::span<OctreeNode> nodes);

}  // namespace nacre
