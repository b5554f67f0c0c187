// Making and evaluating surfaces.
#include "nacre/transport/bsdf.h"

#include "nacre/optics/fresnel.h"

namespace nacre {
namespace {

Bsdf from_model(const DiffuseSurface& surface) {
  Bsdf bsdf;
  bsdf.diffuse = surface.reflectance;
  return bsdf;
}

Bsdf from_model(const DielectricSurface& surface) {
  Bsdf bsdf;
  bsdf.specular = bsdf.transmits = true;
  bsdf.eta = surface.int_ior / surface.ext_ior;
  bsdf.specular_reflectance = surface.specular_reflectance;
  bsdf.specular_transmittance = surface.specular_transmittance;
  return bsdf;
}

Bsdf from_model(const PlasticSurface& surface) {
  Bsdf bsdf;
  bsdf.diffuse = surface.diffuse_reflectance;
  bsdf.coated = bsdf.specular = true;
  bsdf.nonlinear = surface.nonlinear;
  bsdf.eta = surface.int_ior / surface.ext_ior;
  bsdf.internal_reflectance = static_cast<float>(2 * internal_fresnel_moments(bsdf.eta).c1);
  bsdf.specular_reflectance = surface.specular_reflectance;
  return bsdf;
}

}  // namespace

Bsdf make_bsdf(const Surface* surface, const Medium* medium) {
  Bsdf bsdf;
  if (surface)
    bsdf = std::visit([](const auto& model) { return from_model(model); }, surface->model);
  else
    bsdf = medium ? from_model(DielectricSurface{}) : from_model(DiffuseSurface{});
  // What passes the boundary of a medium is the medium's to answer for, and a bare boundary is that of the
  // medium's eta.
  if (medium && bsdf.transmits) {
    bsdf.transmits = false;
    bsdf.eta = medium->eta();
  }
  return bsdf;
}

Rgb eval_diffuse(const Bsdf& bsdf, float cos_i, float cos_o) noexcept {
  if (!bsdf.coated) return bsdf.diffuse / kPi;
  // Source: the plastic model of Mitsuba 0.6; in at F_t, any number of internal reflections, out at F_t.
  const float through = (1 - fresnel_reflectance(cos_i, bsdf.eta)) *
                        (1 - fresnel_reflectance(cos_o, bsdf.eta)) / (bsdf.eta * bsdf.eta * kPi);
  Rgb value;
  for (int k = 0; k < 3; ++k) {
    const float back = bsdf.internal_reflectance * (bsdf.nonlinear ? bsdf.diffuse[k] : 1.0f);
    value[k] = through * bsdf.diffuse[k] / (1 - back);
  }
  return value;
}

}  // namespace nacre
