// Triangulation of polygons.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "nacre/geometry/mesh.h"

namespace nacre {

/// Appends triangles (indices into `corners`) that cover a simple polygon, convex or not, which need not be
/// quite flat. Prefers short diagonals. Polygons of more than 64 corners, and those that cross themselves,
/// become fans. Fewer than three corners give nothing.
void triangulate_polygon(std::span<const Vec3> corners, std::vector<Triangle>& triangles);

}  // namespace nacre
