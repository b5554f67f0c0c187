// All triangles of one group as one surface: areas, connected pieces, and the edges at which it ends or turns
// sharply.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "nacre/base/math.h"
#include "nacre/base/sampling.h"
#include "nacre/geometry/mesh.h"

namespace nacre {

/// Two points lie on the same sheet of a surface if their normals agree at least this well (cosine). Points
/// on different sheets neither keep each other at a distance nor share area: the two sides of a thin wall,
/// the two faces at a cube's edge.
inline constexpr float kSameSheetCosine = 0.2f;

/// An edge that bounds a sheet: a border of the surface or a crease sharper than kSameSheetCosine.
struct SheetEdge {
  Vec3 a, b;
  Vec3 normal;  // of one face at the edge; a crease is listed once for each of its faces. Zero for a face so
                // thin that it has none: its border is one for every sheet
};

struct GroupSurface {
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
  Distribution areas;                     // triangles by area; total() is the surface area
  std::vector<std::uint32_t> components;  // edge-connected piece of each triangle
  std::uint32_t component_count = 0;
  std::vector<SheetEdge> sheet_edges;

  Vec3 normal(std::size_t triangle) const;   // unit; zero if degenerate
  float extent(std::size_t triangle) const;  // longest edge
};

GroupSurface make_group_surface(std::span<const Mesh* const> meshes);

}  // namespace nacre
