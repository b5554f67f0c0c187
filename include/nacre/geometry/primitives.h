// The built-in shapes as meshes in their own space, as Mitsuba 0.6 defines them, fine enough that neither
// silhouette nor shading shows that they are made of triangles. All carry normals and texture coordinates.
#pragma once

#include "nacre/geometry/mesh.h"

namespace nacre {

/// Unit sphere around the origin: an icosahedron subdivided to 81,920 triangles (deviation 4e-5 of the
/// radius).
Mesh make_sphere();
/// [-1,1]^2 in the xy-plane, facing +z: two triangles.
Mesh make_rectangle();
/// [-1,1]^3, outward normals per face: 12 triangles.
Mesh make_cube();
/// Unit disk in the xy-plane, facing +z.
Mesh make_disk();
/// Lateral surface without caps between p0 and p1, outward normals. Throws Error(kValue, place) if radius <=
/// 0 or p0 = p1.
Mesh make_cylinder(const Vec3& p0, const Vec3& p1, float radius, const std::string& place);

}  // namespace nacre
