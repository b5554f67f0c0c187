// Surface points by area or by distance, each with its irradiance.
#include "nacre/render/monte_carlo.h"

#include <array>

#include "nacre/base/random.h"
#include "nacre/base/sampling.h"
#include "nacre/optics/profile.h"
#include "nacre/transport/irradiance.h"

namespace nacre {
namespace {

// Surfaces on one probe ray, against meshes without end.
constexpr int kMostProbeHits = 1024;

struct SurfaceSample {
  Hit hit;  // of the world
  const Mesh* mesh;
  Vec3 position;
};

// Densities over radius on a disc: the mean of exponentials, divided by the circumference.
class RadialDensity {
 public:
  explicit RadialDensity(const Medium& medium, double diameter) {
    const Reduced reduced = reduce(medium);
    for (int k = 0; k < 3; ++k) {
      const double near = medium.scale / static_cast<double>(reduced.mean_free_path[k]);
      const double far = static_cast<double>(reduced.sigma_tr[k]) * medium.scale;
      // A slower fall than across the whole object would waste samples.
      rates_[2 * static_cast<std::size_t>(k)] = std::max(near, 1 / diameter);
      rates_[2 * static_cast<std::size_t>(k) + 1] = std::max(far, 1 / diameter);
    }
  }
  double sample(double choice, double u) const {
    const auto i = static_cast<std::size_t>(choice * static_cast<double>(rates_.size()));
    return -std::log1p(-u) / rates_[std::min(i, rates_.size() - 1)];
  }
  double pdf(double radius) const {
    double sum = 0;
    for (const double rate : rates_) sum += rate * std::exp(-rate * radius);
    return sum / (static_cast<double>(rates_.size()) * 2 * kPiD * radius);
  }

 private:
  std::array<double, 6> rates_;
};

struct Axis {
  Vec3 direction;
  float probability;
};
std::array<Axis, 3> probe_axes(const Vec3& normal) {
  const Frame frame = make_frame(normal);
  return {{{frame.n, 0.5f}, {frame.s, 0.25f}, {frame.t, 0.25f}}};
}

std::vector<const Mesh*> meshes_of(const Scene& scene, std::span<const std::uint32_t> shapes) {
  std::vector<const Mesh*> meshes;
  for (const std::uint32_t i : shapes) meshes.push_back(&scene.shapes[i].mesh);
  return meshes;
}

}  // namespace

struct MonteCarloDiffusion::Impl {
  const World& world;
  MonteCarloSampling sampling;
  int bounces;
  float eta;
  std::array<Profile, 3> profiles;
  std::vector<std::uint32_t> world_meshes;  // the medium's own, as the world numbers them
  std::vector<const Mesh*> meshes;
  RayTracer tracer;                     // of the medium's own surfaces
  Distribution shapes;                  // by area
  std::vector<Distribution> triangles;  // of each mesh, by area
  RadialDensity density;

  Impl(const World& of_world, std::size_t medium, const Medium& material, MonteCarloSampling how,
       int bounce_count)
      : world(of_world),
        sampling(how),
        bounces(bounce_count),
        eta(material.eta()),
        profiles(make_profiles(material)),
        world_meshes(shapes_of_medium(*of_world.scene, medium)),
        meshes(meshes_of(*of_world.scene, world_meshes)),
        tracer(meshes),
        density(material, std::max(double{tracer.bounds().size().length()}, 1e-30)) {
    std::vector<double> totals;
    for (const Mesh* mesh : meshes) {
      triangles.emplace_back(triangle_areas(*mesh));
      totals.push_back(triangles.back().total());
    }
    shapes = Distribution(totals);
  }

  // A hit on the medium's own mesh number `mesh`.
  SurfaceSample world_sample(std::size_t mesh, Hit hit) const {
    hit.mesh = world_meshes[mesh];
    return {hit, meshes[mesh], hit_position(*meshes[mesh], hit)};
  }

  // What one surface point sends to x, if it was chosen with a density per area of `pdf`.
  Rgb weigh(const Vec3& x, const SurfaceSample& sample, double pdf, std::uint64_t key,
            std::uint32_t index) const {
    const double distance = (Vec3d(sample.position) - Vec3d(x)).length();
    // A point upon x itself: a density without bound, or none at all.
    if (!(pdf > 0) || !std::isfinite(pdf) || distance == 0) return {0, 0, 0};
    const Vec3 normal = face_normal(*sample.mesh, sample.hit.triangle);
    const float extent = triangle_extent(*sample.mesh, sample.hit.triangle);
    const Receiver receiver{sample.position, normal, offset_from_surface(sample.position, normal, extent),
                            eta, surface_albedo(world, sample.hit, true)};
    Rgb value = estimate_irradiance(world, receiver, 1, bounces, key, index);
    for (int k = 0; k < 3; ++k)
      value[k] *= static_cast<float>(eval_profile(profiles[static_cast<std::size_t>(k)], distance) / pdf);
    return value;
  }

  Rgb sample_by_area(const Vec3& x, std::uint64_t key, std::uint32_t index) const {
    // Finer than the 24 bits of a float, for meshes of millions of triangles.
    double choice =
        double{sobol_1d(index, hash_words(key, 0))} + 0x1p-24 * to_unit_double(hash_words(key, 3, index));
    const std::size_t shape = shapes.sample(choice);
    const std::size_t triangle = triangles[shape].sample(choice);
    const Vec2 b = sample_uniform_triangle(sobol_2d(index, hash_words(key, 1)));
    const Hit hit{0, 0, static_cast<std::uint32_t>(triangle), b.x, b.y};
    return weigh(x, world_sample(shape, hit), 1 / shapes.total(), hash_words(key, 2), index);
  }

  Rgb sample_by_distance(const SurfacePoint& from, std::uint64_t key, std::uint32_t index) const {
    const std::array<Axis, 3> axes = probe_axes(from.geometric_normal);
    const Vec2 choice = sobol_2d(index, hash_words(key, 0));
    const std::size_t a = choice.x < 0.5f ? 0 : choice.x < 0.75f ? 1 : 2;
    const Vec2 u = sobol_2d(index, hash_words(key, 1));
    const auto radius = static_cast<float>(density.sample(double{choice.y}, double{u.x}));
    const float angle = 2 * kPi * u.y;
    const Frame disc = make_frame(axes[a].direction);
    const Vec3 centre = from.position + (disc.s * std::cos(angle) + disc.t * std::sin(angle)) * radius;

    // From one end of the object to the other.
    const Box3 box = tracer.bounds();
    const float reach = (box.center() - centre).length() + box.size().length();
    Ray ray{centre - disc.n * reach, disc.n};
    Rgb sum(0, 0, 0);
    for (int n = 0; n < kMostProbeHits; ++n) {
      const Hit hit = tracer.intersect(ray);
      if (!hit) break;
      const Mesh& mesh = *meshes[hit.mesh];
      const Vec3 position = hit_position(mesh, hit);
      const Vec3 normal = face_normal(mesh, hit.triangle);
      double pdf = 0;
      for (const Axis& axis : axes) {
        const Vec3d to = Vec3d(position) - Vec3d(from.position), along(axis.direction);
        pdf += static_cast<double>(axis.probability * std::abs(dot(normal, axis.direction))) *
               density.pdf((to - along * to.dot(along)).length());
      }
      sum += weigh(from.position, world_sample(hit.mesh, hit), pdf,
                   hash_words(key, 2, static_cast<std::uint64_t>(n)), index);
      const float side = dot(normal, disc.n) > 0 ? 1.0f : -1.0f;
      const Vec3 origin = offset_from_surface(position, normal * side, triangle_extent(mesh, hit.triangle));
      if (!(dot(origin - ray.origin, disc.n) > 0)) break;  // as far as precision goes
      ray.origin = origin;
    }
    return sum;
  }
};

MonteCarloDiffusion::MonteCarloDiffusion(const World& world, std::size_t medium, const Medium& material,
                                         MonteCarloSampling sampling, int bounces)
    : impl_(std::make_unique<const Impl>(world, medium, material, sampling, bounces)) {}
MonteCarloDiffusion::~MonteCarloDiffusion() = default;
MonteCarloDiffusion::MonteCarloDiffusion(MonteCarloDiffusion&&) noexcept = default;

Rgb MonteCarloDiffusion::estimate(const SurfacePoint& point, int samples, std::uint64_t key,
                                  std::uint32_t first_sample) const {
  Rgb sum(0, 0, 0);
  for (int i = 0; i < samples; ++i) {
    const std::uint32_t index = first_sample + static_cast<std::uint32_t>(i);
    sum += impl_->sampling == MonteCarloSampling::kUniform ? impl_->sample_by_area(point.position, key, index)
                                                           : impl_->sample_by_distance(point, key, index);
  }
  return sum / static_cast<float>(samples);
}

}  // namespace nacre
