// Planning a bake and running it group by group.
#include "nacre/bake/bake.h"

#include <fmt/format.h>

#include "bake/area_shares.h"
#include "bake/group_surface.h"
#include "bake/placement.h"
#include "bake/translucent_radiance.h"
#include "nacre/base/parallel.h"
#include "nacre/base/random.h"
#include "nacre/base/version.h"
#include "nacre/cache/fingerprint.h"
#include "nacre/cache/octree.h"
#include "nacre/transport/surface.h"

namespace nacre {
namespace {

// Rounds of light between translucent objects.
constexpr int kInterreflections = 2;
// Per sample in the file: ten planes and its part of the nodes, about one to five samples.
constexpr double kBytesPerSample = 4.0 * static_cast<double>(kPlaneCount) + 64.0 / 3;

std::vector<const Mesh*> group_meshes(const Scene& scene, std::size_t medium) {
  std::vector<const Mesh*> meshes;
  for (const std::uint32_t i : shapes_of_medium(scene, medium)) meshes.push_back(&scene.shapes[i].mesh);
  return meshes;
}

std::string text(const Rgb& c) { return fmt::format("{} {} {}", c.x, c.y, c.z); }

KeyValues make_info(const Scene& scene, const BakePlan& plan, const BakeParams& params,
                    const std::vector<CacheGroup>& groups) {
  KeyValues info{{"nacre", kVersion}, {"seed", fmt::format("{}", params.seed)}};
  for (std::size_t m = 0; m < groups.size(); ++m) {
    const Medium& medium = scene.media[m];
    const std::string name = "group " + groups[m].name;
    const double count = static_cast<double>(groups[m].size());
    info.emplace_back(name + "/spacing_mm",
                      fmt::format("{:.6g}", hexagonal_spacing(groups[m].surface_area, count) * medium.scale));
    info.emplace_back(name + "/mm_per_unit", fmt::format("{}", medium.scale));
    info.emplace_back(name + "/irradiance_samples", fmt::format("{}", plan.groups[m].irradiance_samples));
    info.emplace_back(name + "/material", medium.material);
    info.emplace_back(name + "/sigma_s", text(medium.sigma_s));
    info.emplace_back(name + "/sigma_a", text(medium.sigma_a));
    info.emplace_back(name + "/g", text(medium.g));
  }
  return info;
}

// Samples without irradiance yet, and the size of the triangle that each lies on.
struct PlacedSamples {
  SurfaceSamples samples;
  std::vector<float> extents;
  std::vector<Rgb> albedos;  // on the way in; empty where the surface is white
  double surface_area = 0;
};

// Weights of a triangle's second and third vertex at a point of it.
Vec2 barycentric(const Mesh& mesh, const Triangle& t, const Vec3& position) {
  const Vec3d a(mesh.positions[t[0]]), b = Vec3d(mesh.positions[t[1]]) - a,
                                       c = Vec3d(mesh.positions[t[2]]) - a, p = Vec3d(position) - a,
                                       n = b.cross(c);
  const double scale = n.length2();
  if (!(scale > 0)) return {0, 0};
  return {static_cast<float>(std::clamp(n.dot(p.cross(c)) / scale, 0.0, 1.0)),
          static_cast<float>(std::clamp(n.dot(b.cross(p)) / scale, 0.0, 1.0))};
}

// surface_albedo at points whose triangles are numbered over all shapes of a medium.
std::vector<Rgb> entry_albedos(const World& world, std::size_t medium, std::span<const PlacedPoint> points) {
  const Scene& scene = *world.scene;
  const SubsurfaceSettings& settings = scene.subsurface[medium];
  if (settings.albedo_texture == kNone && settings.surface_albedo == Rgb(1, 1, 1)) return {};
  const std::vector<std::uint32_t> shapes = shapes_of_medium(scene, medium);
  std::vector<std::uint32_t> first_triangles;
  std::uint32_t count = 0;
  for (const std::uint32_t i : shapes) {
    first_triangles.push_back(count);
    count += static_cast<std::uint32_t>(scene.shapes[i].mesh.triangles.size());
  }
  std::vector<Rgb> albedos(points.size());
  parallel_for(points.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto at = static_cast<std::size_t>(std::ranges::upper_bound(first_triangles, points[i].triangle) -
                                               first_triangles.begin() - 1);
      const Mesh& mesh = scene.shapes[shapes[at]].mesh;
      const std::uint32_t triangle = points[i].triangle - first_triangles[at];
      const Vec2 b = barycentric(mesh, mesh.triangles[triangle], points[i].position);
      albedos[i] = surface_albedo(world, {0, shapes[at], triangle, b.x, b.y}, true);
    }
  });
  return albedos;
}

PlacedSamples place_samples(const World& world, std::size_t medium, const GroupSurface& surface,
                            double points, std::uint64_t seed, Progress& progress) {
  const std::vector<PlacedPoint> placed = place_points(surface, points, seed, progress);
  PlacedSamples result;
  result.samples.areas = compute_area_shares(surface, placed, progress);
  result.surface_area = surface.areas.total();
  result.albedos = entry_albedos(world, medium, placed);
  const std::size_t count = placed.size();
  result.samples.positions.resize(count);
  result.samples.normals.resize(count);
  result.extents.resize(count);
  parallel_for(count, 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      result.samples.positions[i] = placed[i].position;
      result.samples.normals[i] = placed[i].normal;
      result.extents[i] = surface.extent(placed[i].triangle);
    }
  });
  return result;
}

}  // namespace

BakePlan plan_bake(const Scene& scene, const BakeParams& params) {
  BakePlan plan;
  std::vector<double> weights;  // area in squared mean free paths
  double total_weight = 0;
  for (std::size_t m = 0; m < scene.media.size(); ++m) {
    const Medium& medium = scene.media[m];
    const SubsurfaceSettings& settings = scene.subsurface[m];
    GroupPlan group;
    group.name = medium_name(scene, m);
    for (const Mesh* mesh : group_meshes(scene, m)) group.surface_area += surface_area(*mesh);
    if (!(group.surface_area > 0))
      fail(ErrorCode::kValue, medium.place, "the shapes of {} have no surface to put samples on",
           medium_label(scene, m));
    const double length = static_cast<double>(smallest_mean_free_path(medium)) / medium.scale;  // scene units
    if (!std::isfinite(length))
      fail(ErrorCode::kValue, medium.place, "{} neither scatters nor absorbs; give it coefficients above 0",
           medium_label(scene, m));
    // Nothing is summed over the samples of a medium that is taken for an opaque surface; one keeps its
    // place.
    weights.push_back(medium.lambert ? 0 : group.surface_area / square(length));
    total_weight += weights.back();
    const double spacing = params.spacing_mm ? *params.spacing_mm / medium.scale : kDefaultSpacing * length;
    group.points = 2 / std::sqrt(3.0) * group.surface_area / square(spacing);
    if (!params.spacing_mm) group.points = std::max(group.points, kFewestPoints) * settings.sample_multiplier;
    if (medium.lambert) group.points = 1;
    group.irradiance_samples = params.irradiance_samples.value_or(
        settings.irradiance_samples > 0 ? settings.irradiance_samples : kDefaultIrradianceSamples);
    group.bounces = irradiance_bounces(scene, m, params.bounces);
    plan.groups.push_back(group);
  }
  if (plan.groups.empty())
    fail(ErrorCode::kValue, scene.path, "no shape is translucent; give one a <subsurface type=\"dipole\">");
  for (std::size_t m = 0; m < plan.groups.size(); ++m) {
    GroupPlan& group = plan.groups[m];
    if (params.points && weights[m] > 0) group.points = *params.points * weights[m] / total_weight;
    group.points = std::max(group.points, 1.0);
    group.spacing_mm = hexagonal_spacing(group.surface_area, group.points) * scene.media[m].scale;
    plan.points += group.points;
  }
  plan.bytes = 4096 + plan.points * kBytesPerSample;
  if (!(plan.points <= kMostPoints))
    fail(ErrorCode::kLimit, scene.path,
         "the bake would need {:.3g} samples, more than {:.0f} million; check `scale` (mm per scene unit) or "
         "give --spacing or --points",
         plan.points, kMostPoints / 1e6);
  return plan;
}

namespace {

// Octrees over all groups; `storage` owns them.
std::vector<CacheGroup> build_groups(const BakePlan& plan, std::span<const PlacedSamples> placed,
                                     std::vector<std::shared_ptr<const void>>& storage, Report& report) {
  const StageTimer timer(report, "build_octree");
  storage.clear();
  std::vector<CacheGroup> groups;
  for (std::size_t m = 0; m < placed.size(); ++m)
    groups.push_back(build_group(plan.groups[m].name, placed[m].surface_area, placed[m].samples, storage));
  return groups;
}

}  // namespace

Cache bake(const World& world, const BakePlan& plan, const BakeParams& params, Progress& progress,
           Report& report) {
  const Scene& scene = *world.scene;
  std::vector<PlacedSamples> placed;
  std::vector<int> bounces;
  for (std::size_t m = 0; m < scene.media.size(); ++m) {
    const StageTimer timer(report, "place_samples");
    const GroupSurface surface = make_group_surface(group_meshes(scene, m));
    placed.push_back(
        place_samples(world, m, surface, plan.groups[m].points, hash_words(params.seed, m, 0), progress));
    bounces.push_back(plan.groups[m].bounces);
  }
  const auto light_samples = [&](const TranslucentAnswer& answer) {
    const StageTimer timer(report, "irradiance");
    for (std::size_t m = 0; m < placed.size(); ++m)
      placed[m].samples.irradiance = compute_irradiance(
          world,
          {placed[m].samples.positions, placed[m].samples.normals, placed[m].extents, placed[m].albedos},
          scene.media[m].eta(), plan.groups[m].irradiance_samples, plan.groups[m].bounces,
          hash_words(params.seed, m, 1), progress, answer);
  };

  Cache cache;
  std::vector<std::shared_ptr<const void>> storage;
  light_samples({});
  cache.groups = build_groups(plan, placed, storage, report);
  for (int round = 0; params.interreflect && round < kInterreflections; ++round) {
    const TranslucentRadiance radiance = [&] {
      const StageTimer timer(report, "diffusion");
      return TranslucentRadiance(world, cache.groups, progress);
    }();
    light_samples(std::cref(radiance));
    cache.groups = build_groups(plan, placed, storage, report);
  }
  for (const CacheGroup& group : cache.groups) {
    report.counts["points"] += group.size();
    report.counts["octree_nodes"] += group.nodes.size();
  }
  const StageTimer timer(report, "fingerprint");
  cache.fingerprint = make_fingerprint(scene, bounces, world.shadows, params.interreflect);
  cache.info = make_info(scene, plan, params, cache.groups);
  cache.storage = std::make_shared<const std::vector<std::shared_ptr<const void>>>(std::move(storage));
  return cache;
}

}  // namespace nacre
