// Surfaces in the world.
#include "nacre/transport/surface.h"

#include "nacre/optics/fresnel.h"

namespace nacre {
namespace {

constexpr float kHorizon = 1e-3f;  // least cosine to which directions are brought back

Rgb look_up(const Scene& scene, int texture, const Vec2& uv) {
  return eval_texture(scene.textures[static_cast<std::size_t>(texture)], uv);
}

float side_of(const Vec3& normal, const Vec3& direction) { return dot(normal, direction) < 0 ? -1.0f : 1.0f; }

// Around `normal`, its first axis along growing u.
Frame frame_along_u(const Mesh& mesh, const Hit& hit, const Vec3& normal) {
  const Vec3 tangent = u_tangent(mesh, hit.triangle);
  const Vec3 s = tangent - normal * dot(tangent, normal);
  const float length = s.length();
  if (!(length > 1e-4f * tangent.length())) return make_frame(normal);
  return {s / length, cross(normal, s / length), normal};
}

bool leaks(const SurfaceBsdf& surface, const Vec3& direction) {
  return !(dot(surface.geometric_normal, direction) * dot(surface.frame.n, direction) > 0);
}

}  // namespace

Bsdf bsdf_at(const World& world, const Hit& hit) noexcept {
  Bsdf bsdf = world.bsdfs[hit.mesh];
  const SurfaceTextures& textures = bsdf.textures;
  if (std::max({textures.diffuse, textures.specular_reflectance, textures.specular_transmittance}) == kNone)
    return bsdf;
  const Vec2 uv = texture_coordinates(world.shape(hit).mesh, hit);
  const auto apply = [&](int texture, Rgb& color) {
    if (texture != kNone) color *= look_up(*world.scene, texture, uv);
  };
  apply(textures.diffuse, bsdf.diffuse);
  apply(textures.specular_reflectance, bsdf.specular_reflectance);
  apply(textures.specular_transmittance, bsdf.specular_transmittance);
  return bsdf;
}

Rgb surface_albedo(const World& world, const Hit& hit, bool entry) noexcept {
  const Shape& shape = world.shape(hit);
  if (shape.medium == kNone) return {1, 1, 1};
  const SubsurfaceSettings& settings = world.scene->subsurface[static_cast<std::size_t>(shape.medium)];
  Rgb albedo = settings.surface_albedo;
  if (settings.albedo_texture != kNone)
    albedo *= look_up(*world.scene, settings.albedo_texture, texture_coordinates(shape.mesh, hit));
  const float share = entry ? settings.albedo_at_entry : 1 - settings.albedo_at_entry;
  for (int k = 0; k < 3; ++k)
    if (albedo[k] != 1) albedo[k] = std::pow(albedo[k], share);
  return albedo;
}

Rgb exit_transmittance(const World& world, const Hit& hit, const SurfacePoint& point,
                       const Vec3& out) noexcept {
  const Medium& medium = world.media[static_cast<std::size_t>(world.shape(hit).medium)];
  const float cosine = std::min(dot(point.normal_towards(out), out), 1.0f);
  return surface_albedo(world, hit, false) * (1 - fresnel_reflectance(cosine, medium.eta()));
}

SurfaceBsdf surface_at(const World& world, const Hit& hit, const SurfacePoint& point,
                       const Vec3& out) noexcept {
  const Vec3 normal = point.normal_towards(out) * point.side(out);
  SurfaceBsdf surface{bsdf_at(world, hit), {}, point.geometric_normal};
  const Roughness& roughness = surface.bsdf.roughness;
  surface.frame =
      roughness.u == roughness.v ? make_frame(normal) : frame_along_u(world.shape(hit).mesh, hit, normal);
  return surface;
}

Rgb eval_bsdf(const SurfaceBsdf& surface, const Vec3& in, const Vec3& out) noexcept {
  if (leaks(surface, in) || leaks(surface, out)) return {0, 0, 0};
  return eval_bsdf(surface.bsdf, surface.frame.to_local(in), surface.frame.to_local(out));
}

float pdf_bsdf(const SurfaceBsdf& surface, const Vec3& in, const Vec3& out) noexcept {
  if (leaks(surface, in) || leaks(surface, out)) return 0;
  return pdf_bsdf(surface.bsdf, surface.frame.to_local(in), surface.frame.to_local(out));
}

namespace {

// A sample of the local frame in the world.
BsdfSample place(const SurfaceBsdf& surface, const Vec3& out, BsdfSample sample) {
  if (is_black(sample.weight)) return {};
  sample.direction = surface.frame.to_world(sample.direction).normalized();
  const Vec3& normal = surface.geometric_normal;
  const float side = side_of(normal, out) * (sample.transmitted ? -1.0f : 1.0f);
  const float cosine = dot(sample.direction, normal) * side;
  if (cosine > 0) return sample;
  if (!sample.delta) return {};
  sample.direction = (sample.direction + normal * (side * (kHorizon - cosine))).normalized();
  return sample;
}

}  // namespace

BsdfSample sample_bsdf(const SurfaceBsdf& surface, const Vec3& out, float u_lobe, const Vec2& u) noexcept {
  if (leaks(surface, out)) return {};
  return place(surface, out, sample_bsdf(surface.bsdf, surface.frame.to_local(out), u_lobe, u));
}

SmoothWays smooth_ways(const SurfaceBsdf& surface, const Vec3& out) noexcept {
  if (leaks(surface, out)) return {};
  const SmoothWays ways = smooth_ways(surface.bsdf, surface.frame.to_local(out));
  return {place(surface, out, ways.reflected), place(surface, out, ways.transmitted)};
}

}  // namespace nacre
