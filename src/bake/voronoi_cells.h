// The part of the surface that is nearer to a point than to any other.
#pragma once

#include <cstdint>
#include <vector>

#include "bake/group_surface.h"
#include "bake/point_blocks.h"
#include "nacre/base/progress.h"

namespace nacre {

struct CellAreas {
  std::vector<float> areas;          // scene units^2, of each point's cell
  std::vector<std::uint8_t> closed;  // 1 if only other points bound it, 0 if a border or a crease does
};

/// Areas of the points' Voronoi cells on the surface: each cell is taken in the tangent plane of its point,
/// from neighbours on the same sheet at their distance in space, and ends at borders and sharp creases.
/// `spacing` is the hexagonal spacing of the points, and `blocks` has a reach of kCellReach times that.
CellAreas compute_cell_areas(const GroupSurface& surface, std::span<const PlacedPoint> points,
                             const PointBlocks& blocks, float spacing, Progress& progress);

inline constexpr float kCellReach = 2;

}  // namespace nacre
