// Loop subdivision with OpenMesh.
#pragma once

#include <string>

#include "nacre/base/error.h"
#include "nacre/geometry/mesh.h"

namespace nacre {

/// Refines a mesh `levels` times by Loop's scheme (4^levels triangles), open borders by its boundary rule, on
/// the welded surface; the result has smooth vertex normals (no creases) and no texture coordinates. Throws
/// Error(kLimit, place) above 50 M triangles, Error(kValue, place) if nothing is left of the mesh after
/// degenerate faces are dropped; warns (one line, with `place`) if the mesh is non-manifold, where OpenMesh
/// opens it up. Source: Loop 1987.
Mesh subdivide_loop(const Mesh& mesh, int levels, const std::string& place, Warnings& warnings);

}  // namespace nacre
