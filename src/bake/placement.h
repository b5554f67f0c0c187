// Uniformly distributed points on a surface.
#pragma once

#include <cstdint>
#include <vector>

#include "bake/group_surface.h"
#include "nacre/base/progress.h"

namespace nacre {

struct PlacedPoint {
  Vec3 position;
  std::uint32_t triangle;
  Vec3 normal;  // of the triangle
};

/// Poisson-disk points: no two on one sheet are nearer than 0.71 times the hexagonal spacing of `target`
/// points on the surface, and hardly another would fit; about `target` of them come out. By dart throwing
/// with area-uniform candidates, in blocks of space that work in parallel; the result depends on surface,
/// target and seed alone. Source: Cook 1986; White et al. 2007 for the grid.
std::vector<PlacedPoint> place_points(const GroupSurface& surface, double target, std::uint64_t seed,
                                      Progress& progress);

}  // namespace nacre
