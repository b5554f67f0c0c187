// Paths, vertex by vertex.
#include "nacre/transport/path.h"

#include "nacre/base/random.h"

namespace nacre {
namespace {

// Bounces that are followed in any case, before Russian roulette.
constexpr int kSureBounces = 4;

// What a random number at one vertex is for.
enum Purpose : std::uint64_t { kLobe = 21, kDirection, kConnection, kSurvival };

// The normal that connections at a surface are made with: light may come from both sides of glass.
Vec3 connecting_normal(const ScatterPoint& at) {
  return at.surface.bsdf.transmits
             ? kNoNormal
             : at.surface.frame.n * (dot(at.surface.frame.n, at.out) < 0 ? -1.0f : 1.0f);
}

PathRay ray_from(const ScatterPoint& at, const Vec3& direction) {
  PathRay next;
  next.ray = {at.point.origin(at.point.side(direction)), direction};
  return next;
}

NextRay smooth_ray(const ScatterPoint& at, const PathRay& before, const BsdfSample& sample) {
  NextRay next{ray_from(at, sample.direction), sample.weight, true};
  // Straight on from the eye by mirrors and glass alone, or not.
  next.ray.emission = before.emission && before.density == 0;
  return next;
}

// What connections leave of a light to a ray.
float ray_share(const World& world, const PathRay& ray, std::size_t light, float light_pdf) {
  const float count = expected_connections(world, light, ray.position, ray.normal, ray.light_samples);
  return 1 - connection_weight(light_pdf, count * light_pdf, ray.density, ray.span);
}

}  // namespace

LobeSpan lobe_span(const Bsdf& bsdf, float cos_o) noexcept {
  constexpr float kDiffuse = kPi;
  if (!bsdf.specular || !bsdf.rough()) return {};
  // Mirrored directions turn by twice as much as facets do.
  const float rough = std::min(4 * kPi * bsdf.roughness.u * bsdf.roughness.v, kDiffuse);
  // Seen aslant, facets turn them as much in the plane of incidence and less across it.
  return {rough * std::clamp(cos_o, 0.0f, 1.0f), is_black(bsdf.diffuse) ? rough : kDiffuse};
}

float connection_weight(float light_pdf, float connections, float rays, const LobeSpan& span) noexcept {
  constexpr float kFar = 4;
  if (!(connections > 0)) return 0;
  if (!(rays > 0) || span.narrow * light_pdf > kFar) return 1;
  if (span.wide * light_pdf * kFar < 1) return 0;
  const float ratio = rays / connections;  // squares of densities may overflow
  return 1 / (1 + ratio * ratio);
}

Rgb emitted_radiance(const World& world, const PathRay& ray, const Hit& hit) noexcept {
  if (!ray.emission) return {0, 0, 0};
  if (!hit) {
    const Rgb radiance = environment_radiance(world, ray.ray.direction);
    if (ray.density == 0 || is_black(radiance)) return radiance;
    const std::size_t light = world.lights->environment;
    return radiance *
           ray_share(world, ray, light, pdf_light(world, light, ray.position, ray.ray.direction, ray.normal));
  }
  const Shape& shape = world.shape(hit);
  if (shape.light == kNone || dot(face_normal(shape.mesh, hit.triangle), ray.ray.direction) >= 0)
    return {0, 0, 0};
  const auto light = static_cast<std::size_t>(shape.light);
  if (!world.sends(light)) return {0, 0, 0};
  const Rgb radiance = std::get<AreaLight>(world.scene->lights[light].model).radiance;
  if (ray.density == 0) return radiance;
  return radiance * ray_share(world, ray, light, pdf_light(world, light, ray.position, hit));
}

ScatterPoint scatter_point(const World& world, const Hit& hit, const Vec3& out) noexcept {
  const SurfacePoint point = surface_point(world, hit);
  return {hit, point, out, surface_at(world, hit, point, out)};
}

Rgb reflect_direct_light(const World& world, const ScatterPoint& at, int samples, std::uint64_t key,
                         std::uint32_t first_sample, Continuation continuation) {
  Rgb sum(0, 0, 0);
  const Bsdf& bsdf = at.surface.bsdf;
  if (is_black(bsdf.diffuse) && !(bsdf.specular && bsdf.rough())) return sum;
  // Rays do not see what they would if nothing blocked light.
  const LobeSpan span = lobe_span(bsdf, std::abs(dot(at.surface.frame.n, at.out)));
  const bool shared = continuation == Continuation::kGoesOn && world.shadows;
  for_each_connection(world, at.point.position, connecting_normal(at), samples, hash_words(key, kConnection),
                      first_sample, [&](const Connection& connection) {
                        const LightSample& light = connection.sample;
                        const Rgb value = eval_bsdf(at.surface, light.direction, at.out);
                        if (is_black(value)) return;
                        const bool found_by_rays = shared && connection.density > 0;
                        const float weight =
                            found_by_rays
                                ? connection_weight(light.pdf, connection.density,
                                                    pdf_bsdf(at.surface, light.direction, at.out), span)
                                : 1.0f;
                        if (weight == 0 && !world.has_glass) return;
                        const Visibility visibility =
                            see_light(world, at.point.origin(at.point.side(light.direction)), light);
                        sum += value * light.irradiance * visibility.transmittance *
                               (visibility.through_glass ? 1.0f : weight);
                      });
  return sum;
}

NextRay next_ray(const World& world, const ScatterPoint& at, const PathRay& before, int light_samples,
                 std::uint64_t key, std::uint32_t sample) noexcept {
  const float u_lobe = sobol_1d(sample, hash_words(key, kLobe));
  const Vec2 u = sobol_2d(sample, hash_words(key, kDirection));
  const BsdfSample chosen = sample_bsdf(at.surface, at.out, u_lobe, u);
  if (is_black(chosen.weight)) return {};
  if (chosen.delta) return smooth_ray(at, before, chosen);
  NextRay next{ray_from(at, chosen.direction), chosen.weight, false};
  next.ray.emission = world.shadows;  // else all of it came by connections
  next.ray.density = chosen.pdf;
  next.ray.position = at.point.position;
  next.ray.normal = connecting_normal(at);
  next.ray.light_samples = light_samples;
  next.ray.span = lobe_span(at.surface.bsdf, std::abs(dot(at.surface.frame.n, at.out)));
  return next;
}

SmoothRays smooth_rays(const ScatterPoint& at, const PathRay& before) noexcept {
  const SmoothWays ways = smooth_ways(at.surface, at.out);
  return {smooth_ray(at, before, ways.reflected), smooth_ray(at, before, ways.transmitted)};
}

Rgb trace_light(const World& world, PathRay ray, int bounces, std::uint64_t key,
                const TranslucentAnswer& answer) {
  Rgb sum(0, 0, 0), throughput(1, 1, 1);
  for (int bounce = 0;; ++bounce) {
    const Hit hit = world.tracer.intersect(ray.ray);
    sum += throughput * emitted_radiance(world, ray, hit);
    if (!hit) break;
    const Vec3 out = -ray.ray.direction;
    if (world.shape(hit).medium != kNone) {
      if (answer) sum += throughput * answer(hit, out);
      break;
    }
    if (bounce == bounces) break;
    const ScatterPoint at = scatter_point(world, hit, out);
    const std::uint64_t vertex = hash_words(key, static_cast<std::uint64_t>(bounce));
    // At the last vertex connections alone will do for a diffuse surface, if no other answer is wanted.
    const bool ends = bounce + 1 == bounces && !at.surface.bsdf.specular && !answer;
    sum += throughput *
           reflect_direct_light(world, at, 1, vertex, 0, ends ? Continuation::kEnds : Continuation::kGoesOn);
    if (ends) break;
    const NextRay next = next_ray(world, at, ray, 1, vertex, 0);
    if (is_black(next.weight)) break;
    throughput *= next.weight;
    if (bounce >= kSureBounces) {
      const float survive = std::min(0.95f, max_channel(throughput));
      if (to_unit_float(static_cast<std::uint32_t>(hash_words(vertex, kSurvival))) >= survive) break;
      throughput /= survive;
    }
    ray = next.ray;
  }
  return sum;
}

}  // namespace nacre
