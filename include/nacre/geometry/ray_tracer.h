// Rays against meshes, with Embree.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "nacre/geometry/mesh.h"

namespace nacre {

inline constexpr std::uint32_t kNoHit = 0xffffffffu;

struct Ray {
  Vec3 origin;
  Vec3 direction;  // any length; distances are in multiples of it
  float t_min = 0;
  float t_max = std::numeric_limits<float>::infinity();
};

struct Hit {
  float t = 0;
  std::uint32_t mesh = kNoHit;  // index into the meshes that were given
  std::uint32_t triangle = 0;
  float u = 0, v = 0;  // barycentric weights of the triangle's second and third vertex
  explicit operator bool() const { return mesh != kNoHit; }
};

/// A bounding volume hierarchy over meshes, which it refers to and which have to outlive it unchanged; copies
/// share it.
class RayTracer {
 public:
  /// `masks[i]` (all ones if empty) is compared with a ray's mask: a mesh is seen if they share a bit.
  /// Throws Error(kLimit) when Embree runs out of memory, Error(kIo) when it cannot start.
  explicit RayTracer(std::span<const Mesh* const> meshes, std::span<const std::uint32_t> masks = {});

  /// Nearest hit, both sides of every triangle. Watertight across edges (Embree's robust mode); only a ray
  /// that meets a vertex to the last bit may slip through.
  Hit intersect(const Ray& ray, std::uint32_t mask = ~0u) const noexcept;
  /// Whether anything lies between t_min and t_max.
  bool occluded(const Ray& ray, std::uint32_t mask = ~0u) const noexcept;
  /// All hits between t_min and t_max by distance, one for each triangle; false as soon as a mesh is met
  /// whose entry in `passable` (one for each mesh) is 0, or if there are more than 4096, and then `hits` is
  /// of no use.
  bool collect(const Ray& ray, std::span<const std::uint8_t> passable, std::vector<Hit>& hits) const;
  /// Box around everything; empty when there is nothing.
  Box3 bounds() const noexcept;

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

/// The point of a hit from the triangle's own vertices, in double precision and then rounded: within half an
/// ulp of the triangle's plane in every coordinate, unlike origin + t * direction.
Vec3 hit_position(const Mesh& mesh, const Hit& hit) noexcept;
/// Interpolated unit normal of a hit; the face normal where the mesh has no normals.
Vec3 shading_normal(const Mesh& mesh, const Hit& hit) noexcept;

/// Interpolated texture coordinates of a hit; without any, its barycentric (u, v), as in Mitsuba.
Vec2 texture_coordinates(const Mesh& mesh, const Hit& hit) noexcept;
/// Direction in which the first texture coordinate of a triangle grows along it, of any length; zero where
/// there are none or they are degenerate.
Vec3 u_tangent(const Mesh& mesh, std::uint32_t triangle) noexcept;

/// How far off a triangle's plane rays are tested, over Embree's precision: the diameter of the triangle's
/// circumscribed circle. About its longest edge, but more for a flat obtuse one, whose plane is ill defined;
/// at most 1024 edges.
float triangle_extent(const Mesh& mesh, std::uint32_t triangle) noexcept;

/// `position` (a hit_position) moved off the surface along the geometric `normal` (unit length; the side on
/// which the ray is to leave) by a distance that exceeds every rounding error, so that a ray from there does
/// not meet the triangle it starts on. `extent` is that triangle's triangle_extent: the error of Embree grows
/// with it, that of the position with its coordinates. The distance is 5e-7 of the largest coordinate plus
/// 1e-6 of the extent.
Vec3 offset_from_surface(const Vec3& position, const Vec3& normal, float extent) noexcept;

}  // namespace nacre
