// How much of the surface each sample stands for.
#pragma once

#include <vector>

#include "bake/group_surface.h"
#include "bake/placement.h"
#include "nacre/base/progress.h"

namespace nacre {

/// Areas of the points' Voronoi cells on the surface, in scene units^2: each cell is taken in the tangent
/// plane of its point, from neighbours on the same sheet at their distance in space, and ends at borders and
/// sharp creases. The cells of each connected piece of the surface are scaled to add up to its area, and all
/// of them to the whole.
std::vector<float> compute_area_shares(const GroupSurface& surface, const std::vector<PlacedPoint>& points,
                                       Progress& progress);

}  // namespace nacre
