// What is right and wrong with a mesh as a surface: holes, components, orientation, slivers.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nacre/base/math.h"
#include "nacre/geometry/mesh.h"

namespace nacre {

/// Counts are over the welded surface: vertices at bit-identical positions are one.
struct TopologyReport {
  std::uint64_t vertices = 0;  // welded
  std::uint64_t triangles = 0;
  std::uint64_t components = 0;            // edge-connected pieces
  std::uint64_t boundary_edges = 0;        // edges with one face
  std::uint64_t boundary_loops = 0;        // connected chains of boundary edges
  std::uint64_t non_manifold_edges = 0;    // edges with more than two faces
  std::uint64_t flipped_edges = 0;         // edges whose two faces disagree about the orientation
  std::uint64_t duplicate_faces = 0;       // triangles over the same three vertices as an earlier one
  std::uint64_t degenerate_triangles = 0;  // zero area, or a vertex twice
  // Copies of vertices that make the mesh an oriented manifold, which is all that OpenMesh (subdivision)
  // holds.
  std::uint64_t openmesh_added_vertices = 0;
  double area = 0;             // scene units^2
  double volume = 0;           // signed, scene units^3; meaningful when closed()
  Vec3d area_vector{0, 0, 0};  // sum of area times normal: 0 if closed
  Box3 box;
  bool closed() const { return boundary_edges == 0 && non_manifold_edges == 0; }
  /// A surface whose borders span as much as it does, so that closing them makes no body of it.
  bool is_sheet() const { return boundary_edges > 0 && area_vector.length() > 0.5 * area; }
};

TopologyReport analyse_topology(const Mesh& mesh);

/// One line that names what matters for a translucent object ("open: 3 boundary loops ...; 12 degenerate
/// triangles ..."; inside-out if closed with negative volume), or "" for a sound closed mesh.
std::string describe_problems(const TopologyReport& report);

/// What to do about its borders, as the end of that line: "; fillHoles closes holes", or "".
std::string advise_on_borders(const TopologyReport& report);

}  // namespace nacre
