// How much of the surface each sample stands for.
#pragma once

#include <vector>

#include "bake/group_surface.h"
#include "bake/placement.h"
#include "nacre/base/progress.h"

namespace nacre {

/// The points' shares of the surface, in scene units^2: their Voronoi cells, and of a smaller neighbour's
/// cell a little more for a point whose own is larger, so that sums over samples are more even than those
/// over the cells alone. The shares of each connected piece of the surface are scaled to add up to its area,
/// and all of them to the whole.
std::vector<float> compute_area_shares(const GroupSurface& surface, const std::vector<PlacedPoint>& points,
                                       Progress& progress);

}  // namespace nacre
