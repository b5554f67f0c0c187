// Direct and bounced light.
#include "nacre/transport/light.h"

#include <limits>

#include "nacre/base/random.h"

namespace nacre {
namespace {

LightSample sample_model(const World&, const Distribution&, const PointLight& light, const Vec3& x,
                         const Vec2&) {
  const Vec3 to_light = light.position - x;
  const float distance2 = to_light.length2();
  if (!(distance2 > 0)) return {};
  const float distance = std::sqrt(distance2);
  return {to_light / distance, distance, light.position, light.intensity / distance2};
}

LightSample sample_model(const World&, const Distribution&, const DirectionalLight& light, const Vec3&,
                         const Vec2&) {
  return {-light.direction, std::numeric_limits<float>::infinity(), {}, light.irradiance};
}

LightSample sample_model(const World& world, const Distribution& triangles, const AreaLight& light,
                         const Vec3& x, const Vec2& u) {
  const Mesh& mesh = world.scene->shapes[light.shape].mesh;
  double choice = u.x;
  const std::size_t triangle = triangles.sample(choice);
  const Vec2 b = sample_uniform_triangle({static_cast<float>(choice), u.y});
  const Triangle& t = mesh.triangles[triangle];
  const Vec3& p0 = mesh.positions[t[0]];
  const Vec3 p = p0 + (mesh.positions[t[1]] - p0) * b.x + (mesh.positions[t[2]] - p0) * b.y;
  const Vec3 to_light = p - x;
  const float distance2 = to_light.length2();
  const Vec3 normal = face_normal(mesh, triangle);
  const float facing = -dot(to_light, normal);  // times the distance
  if (!(distance2 > 0) || !(facing > 0)) return {};
  const float distance = std::sqrt(distance2);
  return {to_light / distance, distance, p,
          light.radiance * (facing / distance / distance2 * static_cast<float>(triangles.total()))};
}

}  // namespace

LightSample sample_light(const World& world, std::size_t light, const Vec3& x, const Vec2& u) noexcept {
  return std::visit(
      [&](const auto& model) { return sample_model(world, world.emitters[light], model, x, u); },
      world.scene->lights[light].model);
}

bool is_visible(const World& world, const Vec3& origin, const LightSample& sample) noexcept {
  if (!world.shadows) return true;
  if (std::isinf(sample.distance)) return !world.tracer.occluded({origin, sample.direction});
  // Aimed from the origin itself, which lies off the surface, at the light's point and ending short of it by
  // more than rounding, so that the light's own surface does not count.
  constexpr float kReach = 1 - 1e-4f;
  return !world.tracer.occluded({origin, sample.point - origin, 0, kReach});
}

Rgb reflect_direct_light(const World& world, const Bsdf& bsdf, const SurfacePoint& point, const Vec3& out,
                         int samples, std::uint64_t key, std::uint32_t first_sample) noexcept {
  Rgb sum(0, 0, 0);
  const float cos_o = dot(point.shading_normal, out);
  if (is_black(bsdf.diffuse) || cos_o <= 0 || dot(point.geometric_normal, out) <= 0) return sum;
  const Vec3 origin = point.origin(1);
  for (std::size_t light = 0; light < world.scene->lights.size(); ++light) {
    const bool sampled = std::holds_alternative<AreaLight>(world.scene->lights[light].model);
    const int count = sampled ? samples : 1;
    Rgb of_light(0, 0, 0);
    for (int s = 0; s < count; ++s) {
      const Vec2 u = sobol_2d(first_sample + static_cast<std::uint32_t>(s), hash_words(key, light));
      const LightSample sample = sample_light(world, light, point.position, u);
      const float cos_i = dot(point.shading_normal, sample.direction);
      if (is_black(sample.irradiance) || cos_i <= 0 || dot(point.geometric_normal, sample.direction) <= 0)
        continue;
      if (is_visible(world, origin, sample))
        of_light += eval_diffuse(bsdf, cos_i, cos_o) * sample.irradiance * cos_i;
    }
    sum += of_light / static_cast<float>(count);
  }
  return sum;
}

Rgb trace_bounced_light(const World& world, Ray ray, int bounces, std::uint64_t key) noexcept {
  Rgb sum(0, 0, 0), throughput(1, 1, 1);
  for (int bounce = 1; bounce <= bounces; ++bounce) {
    const Hit hit = world.tracer.intersect(ray);
    if (!hit || world.shape(hit).medium != kNone) break;
    const SurfacePoint point = surface_point(world, hit);
    const Vec3 out = -ray.direction;
    const Bsdf& bsdf = world.bsdfs[hit.mesh];
    const float cos_o = dot(point.shading_normal, out);
    if (is_black(bsdf.diffuse) || cos_o <= 0 || dot(point.geometric_normal, out) <= 0) break;
    sum += throughput * reflect_direct_light(world, bsdf, point, out, 1,
                                             hash_words(key, 2 * static_cast<unsigned>(bounce)), 0);
    if (bounce == bounces) break;

    Rng rng(hash_words(key, 2 * static_cast<unsigned>(bounce) + 1));
    const Vec3 local = sample_cosine_hemisphere(rng.next_2d());
    const Vec3 direction = make_frame(point.shading_normal).to_world(local);
    if (local.z <= 0 || dot(direction, point.geometric_normal) <= 0) break;
    throughput *= eval_diffuse(bsdf, local.z, cos_o) * kPi;  // the cosine and its density leave pi
    const float survive = std::min(0.95f, max_channel(throughput));
    if (bounce > 3) {  // Russian roulette
      if (rng.next_float() >= survive) break;
      throughput /= survive;
    }
    ray = {point.origin(1), direction};
  }
  return sum;
}

}  // namespace nacre
