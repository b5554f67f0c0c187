// Loop subdivision with OpenMesh.
#pragma once

#include <string>

#include "nacre/base/error.h"
#include "nacre/geometry/mesh.h"

namespace nacre {

/// Refines a mesh `levels` times by Loop's scheme (4^levels triangles), open borders by its boundary rule, on
/// the welded surface without duplicate faces, and then moves every vertex to its place on the limit surface:
/// the shape is the same for every number of levels. It lies inside of the mesh's corners, as the scheme
/// approximates. The result has the limit surface's normals (smooth, no creases) and no texture coordinates.
/// A mesh that is not an oriented manifold is opened up where it is not, with one warning (with `place`).
/// Throws Error(kLimit, place) above 50 M triangles or 4096 edges at a vertex, Error(kValue, place) if
/// `levels` is negative or nothing is left of the mesh after degenerate faces are dropped. Source: Loop 1987.
Mesh subdivide_loop(const Mesh& mesh, int levels, const std::string& place, Warnings& warnings);

}  // namespace nacre
