// How surfaces scatter: a diffuse part and a smooth dielectric boundary, either of which may be absent.
#pragma once

#include "nacre/scene/scene.h"

namespace nacre {

/// One surface made ready for evaluation; every surface model is a case of this.
struct Bsdf {
  Rgb diffuse{0, 0, 0};    // albedo of the Lambertian part under the coat
  bool coated = false;     // light passes a dielectric boundary on its way to and from the diffuse part
  bool nonlinear = false;  // whether light reflected back inside picks up the colour of the base again
  float internal_reflectance = 0;  // diffuse reflectance of the coat from inside
  bool specular = false;           // mirrors light by Fresnel's equations
  bool transmits = false;          // lets the rest through: clear glass
  float eta = 1;                   // inside relative to outside
  Rgb specular_reflectance{1, 1, 1}, specular_transmittance{1, 1, 1};
};

/// `medium` is the medium behind the surface or nullptr: then a missing surface is Mitsuba's default, 50 %
/// grey diffuse; with a medium it is the medium's own smooth boundary.
Bsdf make_bsdf(const Surface* surface, const Medium* medium);

/// Diffuse part, per steradian, without the cosine, for light from and to the front side: cosines > 0.
/// Reciprocal.
Rgb eval_diffuse(const Bsdf& bsdf, float cos_i, float cos_o) noexcept;

}  // namespace nacre
