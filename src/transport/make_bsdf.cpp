// Making surfaces ready for evaluation.
#include "nacre/optics/fresnel.h"
#include "nacre/transport/bsdf.h"
#include "transport/ggx.h"

namespace nacre {
namespace {

constexpr float kLeastContrast = 1e-3f;

Roughness clean(const Roughness& roughness) {
  if (std::max(roughness.u, roughness.v) < kLeastRoughness) return {};
  return {std::max(roughness.u, kLeastRoughness), std::max(roughness.v, kLeastRoughness)};
}

// Directional albedo of what a rough dielectric reflects, by sampling visible normals on a grid.
float rough_albedo(const Ggx& ggx, float eta, float mu) {
  constexpr int kSteps = 32;
  const Vec3 out(std::sqrt(std::max(0.0f, 1 - mu * mu)), 0, mu);
  double sum = 0;
  for (int i = 0; i < kSteps; ++i)
    for (int j = 0; j < kSteps; ++j) {
      const Vec2 u((static_cast<float>(i) + 0.5f) / kSteps, (static_cast<float>(j) + 0.5f) / kSteps);
      const Vec3 m = ggx.sample_visible_normal(out, u);
      const Vec3 in = reflect(out, m);
      const float cosine = std::min(dot(out, m), 1.0f);
      if (in.z > 0 && cosine > 0)
        sum += static_cast<double>(fresnel_reflectance(cosine, eta) * ggx.shadowing_masking(in, out) /
                                   ggx.masking(out));
    }
  return static_cast<float>(sum / (kSteps * kSteps));
}

CoatTransmittance make_coat(const Ggx& ggx, float eta) {
  CoatTransmittance coat;
  for (std::size_t i = 0; i < coat.nodes.size(); ++i) {
    const float mu = square(static_cast<float>(i) / (CoatTransmittance::kNodes - 1));
    coat.nodes[i] = 1 - rough_albedo(ggx, eta, std::max(mu, 1e-4f));
  }
  return coat;
}

// 2 integral_0^1 T(mu) mu dmu
double mean_transmittance(const CoatTransmittance& coat) {
  constexpr int kSteps = 4096;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double mu = (i + 0.5) / kSteps;
    sum += 2 * mu * static_cast<double>(coat.eval(static_cast<float>(mu))) / kSteps;
  }
  return sum;
}

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
  bsdf.roughness = clean(surface.roughness);
  return bsdf;
}

Bsdf from_model(const PlasticSurface& surface) {
  Bsdf bsdf;
  bsdf.diffuse = surface.diffuse_reflectance;
  bsdf.coated = bsdf.specular = true;
  bsdf.nonlinear = surface.nonlinear;
  bsdf.eta = surface.int_ior / surface.ext_ior;
  bsdf.specular_reflectance = surface.specular_reflectance;
  bsdf.roughness = clean(surface.roughness);
  if (bsdf.rough()) {
    // By reciprocity the transmittances in and out differ by eta^2, so that a white base loses nothing.
    bsdf.coat = make_coat({bsdf.roughness.u, bsdf.roughness.v}, bsdf.eta);
    bsdf.internal_reflectance =
        static_cast<float>(1 - mean_transmittance(bsdf.coat) / square(static_cast<double>(bsdf.eta)));
  } else {
    bsdf.internal_reflectance = static_cast<float>(2 * internal_fresnel_moments(bsdf.eta).c1);
  }
  return bsdf;
}

Bsdf from_model(const ConductorSurface& surface) {
  Bsdf bsdf;
  bsdf.specular = bsdf.metallic = true;
  bsdf.metal_eta = surface.eta;
  bsdf.metal_k = surface.k;
  bsdf.specular_reflectance = surface.specular_reflectance;
  bsdf.roughness = clean(surface.roughness);
  return bsdf;
}

}  // namespace

float CoatTransmittance::eval(float mu) const noexcept {
  const float at = std::sqrt(std::clamp(mu, 0.0f, 1.0f)) * (kNodes - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(at), kNodes - 2);
  const float t = at - static_cast<float>(i);
  return (1 - t) * nodes[i] + t * nodes[i + 1];
}

Bsdf make_bsdf(const Surface* surface, const Medium* medium) {
  auto model = surface  ? surface->model
               : medium ? decltype(surface->model)(DielectricSurface{})
                        : decltype(surface->model)(DiffuseSurface{});
  // The index of a boundary, and what passes it, are the medium's to answer for.
  if (medium)
    std::visit(
        [&](auto& m) {
          if constexpr (requires { m.int_ior; }) {
            m.int_ior = medium->int_ior;
            m.ext_ior = medium->ext_ior;
          }
        },
        model);
  Bsdf bsdf = std::visit([](const auto& m) { return from_model(m); }, model);
  if (surface) {
    bsdf.textures = surface->textures;
    bsdf.two_sided = surface->two_sided;
  }
  if (medium && bsdf.transmits) {
    bsdf.transmits = false;
    bsdf.two_sided = true;
  }
  // Light passes facets between like indices straight on, whatever their normals, which then cannot be told
  // from the directions.
  if (bsdf.transmits && std::abs(bsdf.eta - 1) < kLeastContrast) bsdf.roughness = {};
  return bsdf;
}

}  // namespace nacre
