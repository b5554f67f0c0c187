// Shares that the surface does not bear out.
#pragma once

#include <span>
#include <vector>

#include "bake/group_surface.h"
#include "bake/placement.h"

namespace nacre {

/// Takes from samples what their cell in the tangent plane has more than there is surface: at tips and in
/// folds a surface turns away within less than the samples' spacing, and no neighbour on the same sheet ends
/// the cell. Looks at shares of more than twice the mean only, which even samples do not have, and counts
/// which of many points, spread over the surface by area, are nearest to the sample; 1.5 times what that
/// comes to is the most that it keeps. The rest goes to all samples of its connected piece, in proportion, so
/// that sums stay. Depends on surface, points and shares alone.
void limit_shares(const GroupSurface& surface, std::span<const PlacedPoint> points,
                  std::vector<float>& shares);

}  // namespace nacre
