// Sampling and choosing lights, and what lies on the way to them.
#include "nacre/transport/light.h"

#include <limits>

#include "nacre/optics/fresnel.h"
#include "nacre/transport/area_light.h"
#include "nacre/transport/surface.h"

namespace nacre {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Least and largest share of the choices that lights infinitely far away get beside others: how much of
// either a point really sees is not known.
constexpr double kLeastShare = 0.1;

// What sampling a light depends on.
struct Query {
  const World& world;
  std::size_t light;
  const Vec3& x;
  const Vec3& normal;
  const Vec2& u;
};

LightSample sample_intensity(const Vec3& position, const Vec3& x, const Rgb& intensity) {
  const Vec3 to_light = position - x;
  const float distance2 = to_light.length2();
  if (!(distance2 > 0)) return {};
  const float distance = std::sqrt(distance2);
  return {to_light / distance, distance, position, intensity / distance2};
}

LightSample sample_model(const Query& query, const PointLight& light) {
  return sample_intensity(light.position, query.x, light.intensity);
}

LightSample sample_model(const Query& query, const SpotLight& light) {
  LightSample sample = sample_intensity(light.position, query.x, light.intensity);
  if (is_black(sample.irradiance)) return {};
  // By the angle's tangent: its cosine cannot tell small angles apart.
  const float along = -dot(sample.direction, light.direction);
  const float across = cross(sample.direction, light.direction).length();
  const float angle = std::atan2(across, along) * (180 / kPi);
  if (angle >= light.cutoff_angle) return {};
  if (angle > light.beam_width)
    sample.irradiance *= (light.cutoff_angle - angle) / (light.cutoff_angle - light.beam_width);
  return sample;
}

LightSample sample_model(const Query&, const DirectionalLight& light) {
  return {-light.direction, kInfinity, {}, light.irradiance};
}

float pdf_constant(const Vec3& direction, const Vec3& normal) {
  return normal == kNoNormal ? 1 / (4 * kPi) : pdf_cosine_hemisphere(dot(direction, normal));
}

LightSample sample_model(const Query& query, const ConstantLight& light) {
  const Vec3 direction = query.normal == kNoNormal
                             ? sample_uniform_sphere(query.u)
                             : make_frame(query.normal).to_world(sample_cosine_hemisphere(query.u));
  const float pdf = pdf_constant(direction, query.normal);
  if (!(pdf > 0)) return {};
  return {direction, kInfinity, {}, light.radiance / pdf, pdf};
}

LightSample sample_model(const Query& query, const EnvironmentMap&) {
  const Environment& map = *query.world.lights->map;
  float pdf = 0;
  const Vec3 direction = map.sample(query.u, pdf);
  if (!(pdf > 0)) return {};
  return {direction, kInfinity, {}, map.radiance(direction) / pdf, pdf};
}

LightSample sample_model(const Query& query, const AreaLight& light) {
  const Mesh& mesh = query.world.scene->shapes[light.shape].mesh;
  const AreaSample sample =
      sample_area_light(mesh, query.world.lights->triangles[query.light], query.x, query.u);
  const Vec3 to_light = sample.point - query.x;
  const float distance = to_light.length();
  if (!(sample.pdf > 0) || !(distance > 0)) return {};
  return {to_light / distance, distance, sample.point, light.radiance / sample.pdf, sample.pdf};
}

}  // namespace

LightSample sample_light(const World& world, std::size_t light, const Vec3& x, const Vec2& u,
                         const Vec3& normal) noexcept {
  if (!world.sends(light)) return {};
  const Query query{world, light, x, normal, u};
  return std::visit([&](const auto& model) { return sample_model(query, model); },
                    world.scene->lights[light].model);
}

float pdf_light(const World& world, std::size_t light, const Vec3& x, const Hit& hit) noexcept {
  const auto* area = std::get_if<AreaLight>(&world.scene->lights[light].model);
  if (!area || !hit || hit.mesh != area->shape) return 0;
  return pdf_area_light(world.shape(hit).mesh, world.lights->triangles[light], x, hit);
}

float pdf_light(const World& world, std::size_t light, const Vec3&, const Vec3& direction,
                const Vec3& normal) noexcept {
  if (light != world.lights->environment) return 0;
  return world.lights->map ? world.lights->map->pdf(direction) : pdf_constant(direction, normal);
}

Rgb environment_radiance(const World& world, const Vec3& direction) noexcept {
  if (world.lights->environment == kNoLight || !world.sends(world.lights->environment)) return {0, 0, 0};
  if (world.lights->map) return world.lights->map->radiance(direction);
  return std::get<ConstantLight>(world.scene->lights[world.lights->environment].model).radiance;
}

Rgb pass_glass(const World& world, const Hit& hit, const Vec3& direction) noexcept {
  if (!world.clear_glass[hit.mesh]) return {0, 0, 0};
  const Bsdf bsdf = bsdf_at(world, hit);
  const SurfacePoint point = surface_point(world, hit);
  const float cosine = std::min(dot(point.normal_towards(direction), direction), 1.0f);
  // Straight through: the angle is that outside, on either side.
  const float reflectance = fresnel_reflectance(cosine, std::max(bsdf.eta, 1 / bsdf.eta));
  return bsdf.specular_transmittance * (1 - reflectance);
}

Ray ray_to_light(const Vec3& origin, const LightSample& sample) noexcept {
  // At the light's point from the origin itself, which may lie off the place that the sample was taken for,
  // and ending short of it by more than rounding.
  constexpr float kReach = 1 - 1e-4f;
  if (std::isinf(sample.distance)) return {origin, sample.direction};
  return {origin, sample.point - origin, 0, kReach};
}

Visibility see_light(const World& world, const Vec3& origin, const LightSample& sample) {
  Visibility visibility;
  if (!world.shadows) return visibility;
  const Ray ray = ray_to_light(origin, sample);
  if (!world.has_glass) {
    if (world.tracer.occluded(ray)) visibility.transmittance = {0, 0, 0};
    return visibility;
  }
  std::vector<Hit> boundaries;
  if (!world.tracer.collect(ray, world.clear_glass, boundaries)) return {{0, 0, 0}};
  for (const Hit& hit : boundaries) visibility.transmittance *= pass_glass(world, hit, sample.direction);
  visibility.through_glass = !boundaries.empty();
  return visibility;
}

namespace {

// The share of the choices at x that lights infinitely far away get.
double distant_share(const LightTable& lights, const Vec3& x, const Vec3& normal) {
  const double distant = lights.distant_irradiance.total();
  if (!(distant > 0)) return 0;
  const double near = lights.near.importance(x, normal);
  if (!(near > 0)) return 1;
  return std::clamp(distant / (distant + near), kLeastShare, 1 - kLeastShare);
}

}  // namespace

LightChoice choose_light(const World& world, const Vec3& x, double u, const Vec3& normal) noexcept {
  const LightTable& lights = *world.lights;
  const double share = distant_share(lights, x, normal);
  if (u < share) {
    u = std::min(u / share, 1 - 0x1p-53);
    const std::size_t at = lights.distant_irradiance.sample(u);
    return {lights.distant[at], share * lights.distant_irradiance.pdf(at)};
  }
  LightChoice choice = lights.near.choose(x, normal, (u - share) / (1 - share));
  choice.probability *= 1 - share;
  return choice;
}

double probability_of_light(const World& world, const Vec3& x, std::size_t light,
                            const Vec3& normal) noexcept {
  const LightTable& lights = *world.lights;
  const double share = distant_share(lights, x, normal);
  const auto found = std::ranges::lower_bound(lights.distant, light);
  if (found != lights.distant.end() && *found == light)
    return share > 0
               ? share *
                     lights.distant_irradiance.pdf(static_cast<std::size_t>(found - lights.distant.begin()))
               : 0;
  return (1 - share) * lights.near.probability(light, x, normal);
}

float expected_connections(const World& world, std::size_t light, const Vec3& x, const Vec3& normal,
                           int samples) noexcept {
  if (world.scene->lights.size() <= kMaxConnectedLights)
    return is_delta(world.scene->lights[light]) ? 1 : static_cast<float>(samples);
  return static_cast<float>(samples * static_cast<double>(kMaxConnectedLights) *
                            probability_of_light(world, x, light, normal));
}

Connection connect_to_light(const World& world, std::size_t light, const Vec3& x, const Vec3& normal,
                            const Vec2& u, float connections) noexcept {
  Connection connection{light, sample_light(world, light, x, u, normal), 0};
  connection.sample.irradiance /= connections;
  connection.density = connection.sample.pdf * connections;
  return connection;
}

Connection connect_to_chosen_light(const World& world, const Vec3& x, const Vec3& normal, int samples,
                                   std::uint64_t key, std::uint32_t index) noexcept {
  // Unlikely lights are further apart than the steps of single precision.
  const double fine = to_unit_double(hash_words(key, 2, index)) * 0x1p-24;
  const double u = std::min(static_cast<double>(sobol_1d(index, hash_words(key, 1))) + fine, 1 - 0x1p-53);
  const LightChoice choice = choose_light(world, x, u, normal);
  if (!(choice.probability > 0)) return {};
  return connect_to_light(
      world, choice.light, x, normal, sobol_2d(index, hash_words(key, 3)),
      static_cast<float>(samples * static_cast<double>(kMaxConnectedLights) * choice.probability));
}

}  // namespace nacre
