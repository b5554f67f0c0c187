// Points on shapes that shine, as seen from somewhere.
#pragma once

#include "nacre/base/sampling.h"
#include "nacre/geometry/ray_tracer.h"

namespace nacre {

/// A point of a light and the density with which it was chosen, per steradian at the place that sees it; 0:
/// no sample, its front does not face that place.
struct AreaSample {
  Vec3 point{0, 0, 0};
  float pdf = 0;
};

/// Samples a mesh whose front shines, seen from x: uniformly by solid angle where it has few triangles and
/// is not tiny, else uniformly by area. `areas` are its triangles by area. Sources: Arvo 1995, "Stratified
/// sampling of spherical triangles"; Van Oosterom & Strackee 1983 (solid angles).
AreaSample sample_area_light(const Mesh& mesh, const Distribution& areas, const Vec3& x,
                             const Vec2& u) noexcept;
/// Density with which sample_area_light gives the point of a hit on that mesh; 0 on its back.
float pdf_area_light(const Mesh& mesh, const Distribution& areas, const Vec3& x, const Hit& hit) noexcept;

}  // namespace nacre
