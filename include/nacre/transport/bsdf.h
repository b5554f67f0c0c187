// How surfaces scatter: a dielectric or metallic boundary, smooth or rough, a diffuse part below it, or one
// of them alone.
#pragma once

#include <array>

#include "nacre/scene/scene.h"

namespace nacre {

/// Share of light that passes a rough coat in either direction, by the cosine outside: T(mu) = 1 - E(mu), E
/// the directional albedo of what the coat reflects. Nodes at mu = (i / (kNodes - 1))^2.
struct CoatTransmittance {
  static constexpr std::size_t kNodes = 24;
  std::array<float, kNodes> nodes{};
  float eval(float mu) const noexcept;
};

/// One surface made ready for evaluation; every surface model is a case of this.
struct Bsdf {
  Rgb diffuse{0, 0, 0};    // albedo of the Lambertian part under the coat
  bool coated = false;     // light passes a dielectric boundary on its way to and from the diffuse part
  bool nonlinear = false;  // whether light reflected back inside picks up the colour of the base again
  float internal_reflectance = 0;  // diffuse reflectance of the coat from inside
  bool specular = false;           // mirrors light by Fresnel's equations
  bool transmits = false;          // lets the rest through: clear glass
  bool metallic = false;           // of complex index metal_eta + i metal_k instead of eta
  bool two_sided = false;          // reflects to the back what it would to the front
  float eta = 1;                   // inside relative to outside
  Rgb metal_eta{0, 0, 0}, metal_k{1, 1, 1};
  Rgb specular_reflectance{1, 1, 1}, specular_transmittance{1, 1, 1};
  Roughness roughness;  // of the boundary: 0, or at least kLeastRoughness in both directions
  SurfaceTextures textures;
  CoatTransmittance coat;  // of a rough coat

  bool rough() const noexcept { return roughness.u > 0; }
};

/// Surfaces that are smoother count as smooth.
inline constexpr float kLeastRoughness = 1e-3f;

/// `medium` is the medium behind the surface or nullptr: then a missing surface is Mitsuba's default, 50 %
/// grey diffuse; with a medium it is the medium's own smooth boundary. What a boundary lets through belongs
/// to the medium: only its reflection is left, the same from both sides. Colours are those of the model:
/// textures are looked up per point, by bsdf_at.
Bsdf make_bsdf(const Surface* surface, const Medium* medium);

/// Diffuse part, per steradian, without the cosine, for light from and to the front side: cosines > 0.
/// Reciprocal.
Rgb eval_diffuse(const Bsdf& bsdf, float cos_i, float cos_o) noexcept;

// What follows works in the local frame of the shading normal: +z is the front, `in` points to where light
// comes from, `out` to where it goes; both are unit vectors that point away from the surface. f is for
// radiance: what passes into a medium of n times the index grows by n^2, and f(in, out) / f(out, in) is the
// square of the index on the side of out over that on the side of in.

/// One direction that light may come from.
struct BsdfSample {
  Vec3 direction{0, 0, 1};
  Rgb weight{0, 0, 0};  // f |cos in| over the density of the sample; black: there is no sample
  float pdf = 0;        // pdf_bsdf of the direction, per steradian; 0 of one that is mirrored or refracted
  bool delta = false;   // mirrored or refracted by a smooth boundary: eval_bsdf leaves it out
  bool transmitted = false;  // in and out are on different sides
};

/// f |cos in| without mirrored and smoothly refracted light.
Rgb eval_bsdf(const Bsdf& bsdf, const Vec3& in, const Vec3& out) noexcept;
/// Density per steradian with which sample_bsdf gives `in`; it integrates to the probability of samples that
/// are neither delta nor black.
float pdf_bsdf(const Bsdf& bsdf, const Vec3& in, const Vec3& out) noexcept;
/// Chooses a part of the bsdf by `u_lobe` and a direction by `u`.
BsdfSample sample_bsdf(const Bsdf& bsdf, const Vec3& out, float u_lobe, const Vec2& u) noexcept;

/// Both ways of light at a smooth boundary: mirrored, and let through. Black where there is none.
struct SmoothWays {
  BsdfSample reflected, transmitted;
};
SmoothWays smooth_ways(const Bsdf& bsdf, const Vec3& out) noexcept;

}  // namespace nacre
