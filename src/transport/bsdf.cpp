// Evaluating and sampling surfaces.
#include "nacre/transport/bsdf.h"

#include "nacre/optics/fresnel.h"
#include "transport/ggx.h"

namespace nacre {
namespace {

// The two directions turned so that `out` is above the surface.
struct Configuration {
  Vec3 in, out;
  float eta;      // beyond the surface relative to the side of out
  float side;     // z of the front: what was turned has to be turned back
  bool reflects;  // whether this side reflects at all
};

Configuration configure(const Bsdf& bsdf, Vec3 in, Vec3 out) {
  const bool behind = out.z < 0;
  if (!behind) return {in, out, bsdf.eta, 1, true};
  in.z = -in.z;
  out.z = -out.z;
  // Clear glass has another medium behind it, everything else a front or nothing.
  return {in, out, bsdf.transmits ? 1 / bsdf.eta : bsdf.eta, -1, bsdf.transmits || bsdf.two_sided};
}

Ggx microfacets(const Bsdf& bsdf) { return {bsdf.roughness.u, bsdf.roughness.v}; }

Rgb reflectance(const Bsdf& bsdf, float cosine, float eta) {
  if (!bsdf.metallic) return bsdf.specular_reflectance * fresnel_reflectance(cosine, eta);
  Rgb value;
  for (int k = 0; k < 3; ++k)
    value[k] = bsdf.specular_reflectance[k] * fresnel_conductor(cosine, bsdf.metal_eta[k], bsdf.metal_k[k]);
  return value;
}

// Share of light that passes the coat.
float coat_transmittance(const Bsdf& bsdf, float cosine) {
  return bsdf.rough() ? bsdf.coat.eval(cosine) : 1 - fresnel_reflectance(cosine, bsdf.eta);
}

// Probability of sampling the boundary rather than the diffuse part.
float boundary_probability(const Bsdf& bsdf, float cos_o) {
  if (!bsdf.specular) return 0;
  if (is_black(bsdf.diffuse)) return 1;
  const float through = bsdf.coated ? coat_transmittance(bsdf, cos_o) : 0.0f;
  const float boundary = (1 - through) * mean_channel(bsdf.specular_reflectance);
  const float base = through * mean_channel(bsdf.diffuse);
  return boundary + base > 0 ? boundary / (boundary + base) : 0.5f;
}

// Normal of the facets that refract between `in` and `out`, on the side of out. Source: Walter et al. 2007,
// eq. 16.
Vec3 refracting_normal(const Configuration& c) {
  const Vec3 h = (c.out + c.in * c.eta).normalized();
  return h.z < 0 ? -h : h;
}

struct Rough {
  Rgb value{0, 0, 0};  // f |cos in|
  float pdf = 0;       // of choosing `in`, given the boundary
};

Rough reflect_roughly(const Bsdf& bsdf, const Configuration& c) {
  const Ggx ggx = microfacets(bsdf);
  const Vec3 h = (c.in + c.out).normalized();
  const float cosine = dot(c.out, h);
  if (!(cosine > 0) || !(h.z > 0)) return {};
  const float density = ggx.density(h) / (4 * c.out.z);
  const float choice = bsdf.transmits ? fresnel_reflectance(cosine, c.eta) : 1.0f;
  return {reflectance(bsdf, cosine, c.eta) * (density * ggx.shadowing_masking(c.in, c.out)),
          choice * density * ggx.masking(c.out)};
}

Rough refract_roughly(const Bsdf& bsdf, const Configuration& c) {
  const Ggx ggx = microfacets(bsdf);
  const Vec3 h = refracting_normal(c);
  const float cos_o = dot(c.out, h), cos_i = dot(c.in, h);
  if (!(cos_o > 0) || !(cos_i < 0)) return {};
  // Source: Walter et al. 2007, eq. 17 and 21.
  const float root = cos_o + c.eta * cos_i;
  const float density = (1 - fresnel_reflectance(cos_o, c.eta)) * ggx.density(h) * cos_o * -cos_i /
                        (std::max(root * root, 1e-12f) * c.out.z);
  return {bsdf.specular_transmittance * (density * ggx.shadowing_masking(c.in, c.out)),
          density * c.eta * c.eta * ggx.masking(c.out)};
}

Rough scatter_roughly(const Bsdf& bsdf, const Configuration& c) {
  if (c.in.z > 0) return reflect_roughly(bsdf, c);
  return bsdf.transmits && c.in.z < 0 ? refract_roughly(bsdf, c) : Rough{};
}

// A direction mirrored or refracted at a facet of normal m, and whether it is refracted.
struct Bounce {
  Vec3 in;
  bool transmitted;
  float probability;
};

Bounce bounce(const Bsdf& bsdf, const Configuration& c, const Vec3& m, float u_lobe) {
  if (!bsdf.transmits) return {reflect(c.out, m), false, 1};
  const float reflected = fresnel_reflectance(std::min(dot(c.out, m), 1.0f), c.eta);
  Vec3 transmitted;
  if (u_lobe < reflected || !refract(c.out, m, c.eta, transmitted))
    return {reflect(c.out, m), false, reflected};
  return {transmitted, true, 1 - reflected};
}

BsdfSample sample_continuous(const Bsdf& bsdf, const Configuration& c, Vec3 in, bool transmitted) {
  in.normalize();
  if (transmitted ? !(in.z < 0) : !(in.z > 0)) return {};
  Vec3 world_in = in, world_out = c.out;
  world_in.z *= c.side;
  world_out.z *= c.side;
  const float pdf = pdf_bsdf(bsdf, world_in, world_out);
  if (!(pdf > 0) || !std::isfinite(pdf)) return {};
  return {in, eval_bsdf(bsdf, world_in, world_out) / pdf, pdf, false, transmitted};
}

}  // namespace

Rgb eval_diffuse(const Bsdf& bsdf, float cos_i, float cos_o) noexcept {
  if (!bsdf.coated) return bsdf.diffuse / kPi;
  // Source: the plastic model of Mitsuba 0.6; in through the coat, any number of internal reflections, out
  // through the coat.
  const float through =
      coat_transmittance(bsdf, cos_i) * coat_transmittance(bsdf, cos_o) / (bsdf.eta * bsdf.eta * kPi);
  Rgb value;
  for (int k = 0; k < 3; ++k) {
    const float back = bsdf.internal_reflectance * (bsdf.nonlinear ? bsdf.diffuse[k] : 1.0f);
    value[k] = through * bsdf.diffuse[k] / (1 - back);
  }
  return value;
}

Rgb eval_bsdf(const Bsdf& bsdf, const Vec3& in, const Vec3& out) noexcept {
  const Configuration c = configure(bsdf, in, out);
  if (!c.reflects || !(c.out.z > 0)) return {0, 0, 0};
  Rgb value(0, 0, 0);
  if (c.in.z > 0 && !is_black(bsdf.diffuse)) value += eval_diffuse(bsdf, c.in.z, c.out.z) * c.in.z;
  if (bsdf.specular && bsdf.rough()) value += scatter_roughly(bsdf, c).value;
  return value;
}

float pdf_bsdf(const Bsdf& bsdf, const Vec3& in, const Vec3& out) noexcept {
  const Configuration c = configure(bsdf, in, out);
  if (!c.reflects || !(c.out.z > 0)) return 0;
  const float boundary = boundary_probability(bsdf, c.out.z);
  float pdf = boundary < 1 ? (1 - boundary) * pdf_cosine_hemisphere(c.in.z) : 0.0f;
  if (boundary > 0 && bsdf.rough()) pdf += boundary * scatter_roughly(bsdf, c).pdf;
  return pdf;
}

BsdfSample sample_bsdf(const Bsdf& bsdf, const Vec3& out, float u_lobe, const Vec2& u) noexcept {
  const Configuration c = configure(bsdf, out, out);
  if (!c.reflects || !(c.out.z > 0)) return {};
  const float boundary = boundary_probability(bsdf, c.out.z);
  BsdfSample sample;
  if (u_lobe >= boundary) {
    if (is_black(bsdf.diffuse)) return {};
    sample = sample_continuous(bsdf, c, sample_cosine_hemisphere(u), false);
  } else if (bsdf.rough()) {
    const Vec3 m = microfacets(bsdf).sample_visible_normal(c.out, u);
    if (!(dot(c.out, m) > 0)) return {};
    const Bounce b = bounce(bsdf, c, m, u_lobe / boundary);
    sample = sample_continuous(bsdf, c, b.in, b.transmitted);
  } else {
    // Glass by its reflectance, everything else only mirrors.
    const SmoothWays ways = smooth_ways(bsdf, out);
    const float mirrored = bsdf.transmits ? fresnel_reflectance(c.out.z, c.eta) : 1.0f;
    const bool reflects = u_lobe < boundary * mirrored;
    sample = reflects ? ways.reflected : ways.transmitted;
    sample.weight /= boundary * (reflects ? mirrored : 1 - mirrored);
    return sample;
  }
  sample.direction.z *= c.side;
  return sample;
}

SmoothWays smooth_ways(const Bsdf& bsdf, const Vec3& out) noexcept {
  const Configuration c = configure(bsdf, out, out);
  if (!c.reflects || !(c.out.z > 0) || !bsdf.specular || bsdf.rough()) return {};
  const Vec3 normal(0, 0, 1);
  SmoothWays ways;
  ways.reflected = {reflect(c.out, normal), reflectance(bsdf, c.out.z, c.eta), 0, true, false};
  ways.reflected.direction.z *= c.side;
  Vec3 transmitted;
  if (bsdf.transmits && refract(c.out, normal, c.eta, transmitted)) {
    transmitted.z *= c.side;
    const float share = 1 - fresnel_reflectance(c.out.z, c.eta);
    ways.transmitted = {transmitted.normalized(), bsdf.specular_transmittance * (share / (c.eta * c.eta)), 0,
                        true, true};
  }
  return ways;
}

}  // namespace nacre
