// Surfaces where rays meet them: textures looked up, directions in world space, no light through corners that
// smooth normals cut.
#pragma once

#include "nacre/transport/world.h"

namespace nacre {

/// The bsdf of a hit shape with its textures at that point.
Bsdf bsdf_at(const World& world, const Hit& hit) noexcept;

/// Factor on light that enters (`entry`) or leaves the translucent shape at `hit`:
/// SubsurfaceSettings::surface_albedo to the power of its share. 1 for other shapes. Only mesh, triangle and
/// u, v of the hit are used.
Rgb surface_albedo(const World& world, const Hit& hit, bool entry) noexcept;

/// Share of light from inside that leaves a translucent shape at `hit` towards `out` (unit): the Fresnel
/// transmittance of its boundary, taken as smooth, times its albedo at the exit.
Rgb exit_transmittance(const World& world, const Hit& hit, const SurfacePoint& point,
                       const Vec3& out) noexcept;

/// A bsdf placed in the world.
struct SurfaceBsdf {
  Bsdf bsdf;
  Frame frame;  // its n is the shading normal, its s the direction of Roughness::u
  Vec3 geometric_normal;
};

/// The surface as `out`, the unit direction to where light goes, sees it: its normal is
/// SurfacePoint::normal_towards that, turned to the front.
SurfaceBsdf surface_at(const World& world, const Hit& hit, const SurfacePoint& point,
                       const Vec3& out) noexcept;

/// eval_bsdf, pdf_bsdf and sample_bsdf for unit directions in world space. Black and 0 for directions that
/// lie on different sides of the shading and the geometric normal. A refracted one that does is brought back
/// to the plane of the triangle, so that glass has no dark rims. A sample's ray starts at
/// SurfacePoint::origin of the side on which its direction lies.
Rgb eval_bsdf(const SurfaceBsdf& surface, const Vec3& in, const Vec3& out) noexcept;
float pdf_bsdf(const SurfaceBsdf& surface, const Vec3& in, const Vec3& out) noexcept;
BsdfSample sample_bsdf(const SurfaceBsdf& surface, const Vec3& out, float u_lobe, const Vec2& u) noexcept;
SmoothWays smooth_ways(const SurfaceBsdf& surface, const Vec3& out) noexcept;

}  // namespace nacre
