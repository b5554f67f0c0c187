// The built-in shapes as meshes in their own space, as Mitsuba 0.6 defines them, fine enough that neither
// silhouette nor shading shows that they are made of triangles. All carry normals and texture coordinates.
#pragma once

#include "nacre/geometry/mesh.h"

namespace nacre {

/// Unit sphere around the origin: an icosahedron subdivided to 81,920 triangles (no point is further than
/// 8e-5 inside of the true sphere). Texture coordinates are (phi / 2 pi, theta / pi), and exceed 1 where a
/// triangle crosses phi = 0.
Mesh make_sphere();
/// [-1,1]^2 in the xy-plane, facing +z: two triangles, with texture coordinates from (0, 0) at (-1, -1) to
/// (1, 1).
Mesh make_rectangle();
/// [-1,1]^3, outward normals and texture coordinates in [0,1]^2 per face: 12 triangles.
Mesh make_cube();
/// Unit disk in the xy-plane, facing +z; texture coordinates are (r, phi / 2 pi).
Mesh make_disk();
/// Lateral surface without caps between p0 and p1, outward normals; texture coordinates are (phi / 2 pi,
/// height above p0 in [0,1]). Throws Error(kValue, place) if radius <= 0 or p0 = p1.
Mesh make_cylinder(const Vec3& p0, const Vec3& p1, float radius, const std::string& place);

}  // namespace nacre
