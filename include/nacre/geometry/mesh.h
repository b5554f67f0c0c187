// Triangle meshes as plain data. Every shape that nacre renders, built-in ones too, is one of these in world
// space.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "nacre/base/math.h"

namespace nacre {

using Triangle = std::array<std::uint32_t, 3>;

struct Mesh {
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;  // indices into positions; counter-clockwise seen from outside
  std::vector<Vec3> normals;        // per vertex, unit length, or empty: then the faces' own normals are used
  std::vector<Vec2> uvs;            // per vertex, or empty
};

/// Twice the area vector of a triangle: its length is 2 * area, its direction the geometric normal.
inline Vec3 area_vector(const Mesh& mesh, std::size_t triangle) {
  const Triangle& t = mesh.triangles[triangle];
  const Vec3& a = mesh.positions[t[0]];
  return cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a);
}

/// Unit geometric normal; zero for a degenerate triangle.
inline Vec3 face_normal(const Mesh& mesh, std::size_t triangle) {
  return area_vector(mesh, triangle).normalized();
}

/// Area of each triangle.
std::vector<double> triangle_areas(const Mesh& mesh);
/// Surface area, summed in double precision, in scene units squared.
double surface_area(const Mesh& mesh);
/// Enclosed volume with sign: positive where closed and faces point outward. Meaningless for open meshes.
double signed_volume(const Mesh& mesh);
/// Smallest box around all vertices that a triangle uses; empty for an empty mesh.
Box3 bounds(const Mesh& mesh);

/// Applies an affine transform to positions and (inverse transpose) normals. A mirroring one also turns every
/// triangle around, so that outside stays outside. Throws Error(kValue, place) if the matrix is singular or
/// not finite.
void transform_mesh(Mesh& mesh, const Matrix4& to_world, const std::string& place);

/// Turns every triangle and normal around.
void flip_normals(Mesh& mesh);

/// For each vertex the index of the first vertex with bit-identical position (-0 equals 0). Files that repeat
/// vertices along seams of normals or texture coordinates are one surface under this map.
std::vector<std::uint32_t> weld_map(const Mesh& mesh);

/// Replaces the normals: angle-weighted averages over faces around a vertex whose normals are within
/// `max_smooth_angle` degrees; splits vertices where they are not. 180 smooths everything. Vertices at the
/// same position are treated as one. Source: Thuermer & Wuthrich 1998 (angle weights).
void compute_normals(Mesh& mesh, double max_smooth_angle);

}  // namespace nacre
