// A scene made ready for light transport: acceleration structure, light and surface tables.
#pragma once

#include <memory>
#include <vector>

#include "nacre/geometry/ray_tracer.h"
#include "nacre/scene/scene.h"
#include "nacre/transport/bsdf.h"
#include "nacre/transport/light_table.h"

namespace nacre {

/// Everything that tracing light needs; copies share the acceleration structure and the
/// tables of lights. The scene has to outlive it
/// unchanged.
struct World {
  const Scene* scene;
  RayTracer tracer;           // mesh i is Scene::shapes[i]
  std::vector<Bsdf> bsdfs;    // parallel to Scene::shapes
  std::vector<Medium> media;  // parallel to Scene::media: those, or what fills them instead
  std::shared_ptr<const LightTable> lights;
  bool shadows = true;
  std::vector<std::uint8_t> clear_glass;  // by shape: whether light passes straight through (see_light)
  bool has_glass = false;                 // any of them
  std::vector<std::uint8_t> muted = {};   // by light: whether it sends nothing; empty: all send

  bool sends(std::size_t light) const { return muted.empty() || !muted[light]; }
  const Shape& shape(const Hit& hit) const { return scene->shapes[hit.mesh]; }
};

/// Throws Error(kValue) for an area light whose shape has no area; Error(kLimit) when memory runs out.
World make_world(const Scene& scene, bool shadows);
/// Follows its scene after media, surfaces or lights have changed, but no mesh. Throws as make_world.
void refresh(World& world);
/// The same world with another material in one of its media.
World fill_medium(World world, std::size_t medium, const Medium& material);

/// Where a ray met a surface.
struct SurfacePoint {
  Vec3 position;
  Vec3 geometric_normal;  // unit, of the triangle's front side
  float extent;           // of the triangle, for offset_from_surface
  Vec3 shading_normal;    // unit, interpolated, on the same side as geometric_normal

  /// Where a ray that leaves to the front (side 1) or the back (side -1) starts.
  Vec3 origin(float side) const noexcept {
    return offset_from_surface(position, geometric_normal * side, extent);
  }
  /// 1 where `direction` points to the front, -1 to the back.
  float side(const Vec3& direction) const noexcept {
    return dot(geometric_normal, direction) > 0 ? 1.0f : -1.0f;
  }
  /// The shading normal on the side of `direction` (unit, pointing away from the surface). Where
  /// interpolation tilts it so far that the mirror image of `direction` would lie inside the triangle's
  /// plane, it is bent back until that image grazes the plane; its cosine with `direction` is above 0.
  Vec3 normal_towards(const Vec3& direction) const noexcept;
};
SurfacePoint surface_point(const World& world, const Hit& hit) noexcept;

}  // namespace nacre
