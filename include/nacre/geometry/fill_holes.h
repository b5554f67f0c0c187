// Closing holes of scanned meshes.
#pragma once

#include <string>

#include "nacre/base/error.h"
#include "nacre/geometry/mesh.h"

namespace nacre {

/// Closes every loop of edges that have one face, on the welded surface: by the triangulation of least area
/// up to a thousand edges, above that by the one over a thousand of its vertices, and between them. New faces
/// agree with their neighbours about which side is outside. Where a mesh has normals, those of the new faces
/// are their own. Edges that form no loop, beside more than two faces, stay open, with a warning (with
/// `place`). Returns the number of loops. Source: Barequet & Sharir 1995, "Filling gaps in the boundary of a
/// polyhedron".
std::size_t fill_holes(Mesh& mesh, const std::string& place, Warnings& warnings);

}  // namespace nacre
