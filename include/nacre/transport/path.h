// Light that has scattered off surfaces: connections to lights and rays that go on, weighted against each
// other.
#pragma once

#include <cstdint>
#include <functional>

#include "nacre/transport/light.h"
#include "nacre/transport/surface.h"

namespace nacre {

/// Solid angles, about, over which the narrowest and the widest part of what scatters light spread their
/// rays, steradians.
struct LobeSpan {
  float narrow = kPi, wide = kPi;  // a cosine
};
/// `cos_o` is the cosine of the view: lobes become narrower towards grazing angles.
LobeSpan lobe_span(const Bsdf& bsdf, float cos_o) noexcept;

/// Weight of connections to a light where rays look for it as well; that of rays is what is missing to 1.
/// `light_pdf` is the density of one connection per steradian, `connections` and `rays` are the densities
/// of all of them. A light far wider than every lobe is left to rays, one far narrower than every lobe to
/// connections, so that the way which hardly has noise gets none from the other; in between the power
/// heuristic divides (Veach 1997, section 9.2).
float connection_weight(float light_pdf, float connections, float rays, const LobeSpan& span) noexcept;

/// A ray that looks for light, and how it was chosen.
struct PathRay {
  Ray ray;
  // Whether emission that it meets counts: not behind a mirror or glass that a diffuse or rough surface sees,
  // because light there arrives by connections, straight through glass, or is a caustic, which is left out.
  bool emission = true;
  // Expected number of rays per steradian in this direction from `position`, against that of the connections
  // made there with `normal` and `light_samples`; 0: there were none.
  float density = 0;
  Vec3 position{0, 0, 0}, normal{0, 0, 0};
  int light_samples = 1;
  LobeSpan span;
};

/// Radiance of lights that the ray meets at `hit`, or where nothing is hit of light all around; times the
/// ray's share beside connections (connection_weight).
Rgb emitted_radiance(const World& world, const PathRay& ray, const Hit& hit) noexcept;

/// A place where light scatters: the surface as it is seen from `out`.
struct ScatterPoint {
  Hit hit;
  SurfacePoint point;
  Vec3 out;  // unit
  SurfaceBsdf surface;
};
ScatterPoint scatter_point(const World& world, const Hit& hit, const Vec3& out) noexcept;

/// Whether next_ray goes on from a point, so that what lights send is divided between it and connections.
enum class Continuation { kEnds, kGoesOn };

/// Radiance that a surface sends towards `out` of what arrives by `samples` connections to the lights
/// (for_each_connection), mirrored and smoothly refracted light excepted.
Rgb reflect_direct_light(const World& world, const ScatterPoint& at, int samples, std::uint64_t key,
                         std::uint32_t first_sample, Continuation continuation);

/// A ray onwards, chosen by the bsdf, and its weight; black if there is none. `before` is the ray that came
/// here.
struct NextRay {
  PathRay ray;
  Rgb weight{0, 0, 0};
  bool delta = false;
};
NextRay next_ray(const World& world, const ScatterPoint& at, const PathRay& before, int light_samples,
                 std::uint64_t key, std::uint32_t sample) noexcept;
/// The rays that a smooth boundary mirrors and lets through, each with its share; weights may be black.
struct SmoothRays {
  NextRay reflected, transmitted;
};
SmoothRays smooth_rays(const ScatterPoint& at, const PathRay& before) noexcept;

/// Radiance that a translucent shape sends towards a direction (unit), where a path has hit it.
using TranslucentAnswer = std::function<Rgb(const Hit& hit, const Vec3& out)>;

/// Light that arrives along a ray: emission, and what opaque surfaces send after up to `bounces` bounces. A
/// translucent shape sends what `answer` says, or nothing. Unbiased but for the caustics that PathRay leaves
/// out; one path.
Rgb trace_light(const World& world, PathRay ray, int bounces, std::uint64_t key,
                const TranslucentAnswer& answer = {});

}  // namespace nacre
