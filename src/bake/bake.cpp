// Planning a bake and running it group by group.
#include "nacre/bake/bake.h"

#include <fmt/format.h>

#include "bake/area_shares.h"
#include "bake/group_surface.h"
#include "bake/illumination.h"
#include "bake/placement.h"
#include "bake/share_limits.h"
#include "nacre/base/parallel.h"
#include "nacre/base/random.h"
#include "nacre/base/version.h"
#include "nacre/cache/fingerprint.h"
#include "nacre/cache/octree.h"
#include "nacre/transport/surface.h"

namespace nacre {
namespace {

// Per sample in the file: ten planes and its part of the nodes, about one to five samples; and for each plane
// of light that there are several of its irradiance, then errors, then ratios.
double bytes_per_sample(std::size_t lights, bool every_eta) {
  const double of_light =
      4 + (lights > 1 ? 12 : 0) + (every_eta ? static_cast<double>(sizeof(EtaRatios)) : 0);
  return 4.0 * static_cast<double>(kPlaneCount) + 64.0 / 3 + static_cast<double>(lights) * of_light;
}

// Lights that are kept apart, by name; one without a name for all of them.
std::vector<std::string> light_planes(const Scene& scene, bool per_light) {
  std::vector<std::string> names;
  for (std::size_t i = 0; per_light && i < scene.lights.size(); ++i)
    if (const std::string name = light_plane_name(scene, i); std::ranges::find(names, name) == names.end())
      names.push_back(name);
  if (names.empty()) names.emplace_back();
  return names;
}

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

// In the order of the octree: neighbours are computed one after the other, and nothing has to be sorted
// later.
std::vector<PlacedPoint> place_in_order(const GroupSurface& surface, double target, std::uint64_t seed,
                                        Progress& progress) {
  const std::vector<PlacedPoint> placed = place_points(surface, target, seed, progress);
  std::vector<Vec3> positions(placed.size());
  std::ranges::transform(placed, positions.begin(), &PlacedPoint::position);
  const std::vector<std::uint32_t> order = octree_order(positions);
  std::vector<PlacedPoint> sorted(placed.size());
  parallel_for(placed.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) sorted[i] = placed[order[i]];
  });
  return sorted;
}

PlacedSamples place_samples(const World& world, std::size_t medium, const GroupSurface& surface,
                            double points, std::uint64_t seed, Progress& progress) {
  const std::vector<PlacedPoint> placed = place_in_order(surface, points, seed, progress);
  PlacedSamples result;
  result.samples.areas = compute_area_shares(surface, placed, progress);
  limit_shares(surface, placed, result.samples.areas);
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
  plan.bytes = 4096 + plan.points * bytes_per_sample(light_planes(scene, params.per_light).size(),
                                                     keeps_every_eta(scene, params));
  if (!(plan.points <= kMostPoints))
    fail(ErrorCode::kLimit, scene.path,
         "the bake would need {:.3g} samples, more than {:.0f} million; check `scale` (mm per scene unit) or "
         "give --spacing or --points",
         plan.points, kMostPoints / 1e6);
  return plan;
}

bool keeps_every_eta(const Scene& scene, const BakeParams& params) {
  return !params.fixed_eta && !params.interreflect && std::ranges::all_of(scene.media, [](const Medium& m) {
    return m.eta() >= kLeastEta && m.eta() <= kMostEta;
  });
}

namespace {

// All that the numbers of a bake depend on, as a hash.
std::string journal_key(KeyValues fingerprint, const Scene& scene, const BakePlan& plan,
                        const BakeParams& params) {
  fingerprint.emplace_back("version", kVersion);
  fingerprint.emplace_back("seed", fmt::format("{}", params.seed));
  fingerprint.emplace_back("error", fmt::format("{}", params.irradiance_error));
  fingerprint.emplace_back("per light", params.per_light ? "yes" : "no");
  for (const GroupPlan& group : plan.groups)
    fingerprint.emplace_back("group", fmt::format("{} {}", group.points, group.irradiance_samples));
  for (const Medium& medium : scene.media) fingerprint.emplace_back("eta", fmt::format("{}", medium.eta()));
  for (const Light& light : scene.lights)
    fingerprint.emplace_back("light", fmt::format("{} {}", light.sampling_weight, light.group));
  return fingerprint_digest(fingerprint);
}

// The world as it is with the lights of one name only.
World with_lights_of(const World& world, const std::string& name) {
  World only = world;
  if (name.empty()) return only;
  only.muted.resize(world.scene->lights.size());
  for (std::size_t i = 0; i < only.muted.size(); ++i)
    only.muted[i] = light_plane_name(*world.scene, i) != name;
  return only;
}

// The irradiance of samples from what their lights send.
void add_up_lights(SurfaceSamples& samples) {
  if (samples.lights.size() == 1) {
    samples.irradiance = std::move(samples.lights[0].irradiance);
    return;
  }
  samples.irradiance.assign(samples.size(), Rgb(0, 0, 0));
  for (const SampleLight& light : samples.lights)
    parallel_for(samples.size(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) samples.irradiance[i] += light.irradiance[i];
    });
}

}  // namespace

Cache bake(const World& world, const BakePlan& plan, const BakeParams& params, Progress& progress,
           Report& report) {
  const Scene& scene = *world.scene;
  std::vector<PlacedSamples> placed;
  std::vector<int> bounces;
  std::vector<double> areas;
  for (std::size_t m = 0; m < scene.media.size(); ++m) {
    const StageTimer timer(report, "place_samples");
    const GroupSurface surface = make_group_surface(group_meshes(scene, m));
    placed.push_back(
        place_samples(world, m, surface, plan.groups[m].points, hash_words(params.seed, m, 0), progress));
    bounces.push_back(plan.groups[m].bounces);
    areas.push_back(placed[m].surface_area);
  }
  KeyValues fingerprint = [&] {
    const StageTimer timer(report, "fingerprint");
    return make_fingerprint(scene,
                            {bounces, world.shadows, params.interreflect, keeps_every_eta(scene, params)});
  }();
  Journal journal(params.journal, journal_key(fingerprint, scene, plan, params), params.journal_after);
  if (journal.found_other())
    progress.warn(
        params.journal +
        ": it is of an interrupted bake of another scene or other options, which this one replaces");
  if (journal.found() > 0) progress.say("going on with the bake that " + params.journal + " is of");
  Illumination illumination(plan, params, placed, journal, progress, report);
  const std::vector<std::string> names = light_planes(scene, params.per_light);
  for (std::size_t plane = 0; plane < names.size(); ++plane) {
    const std::string& name = names[plane];
    if (!params.only_lights.empty() &&
        std::ranges::find(params.only_lights, name) == params.only_lights.end())
      continue;
    std::vector<SampleLight> lights = illumination.compute(with_lights_of(world, name), plane);
    for (std::size_t m = 0; m < placed.size(); ++m) {
      lights[m].name = name;
      placed[m].samples.lights.push_back(std::move(lights[m]));
    }
  }
  std::vector<SurfaceSamples> samples;
  for (PlacedSamples& group : placed) {
    add_up_lights(group.samples);
    samples.push_back(std::move(group.samples));
  }
  placed.clear();
  Cache cache;
  std::vector<std::shared_ptr<const void>> storage;
  cache.groups = build_groups(plan, areas, std::move(samples), storage, report);
  for (std::size_t m = 0; m < cache.groups.size(); ++m) {
    CacheGroup& group = cache.groups[m];
    group.eta = double{scene.media[m].eta()};
    report.counts["points"] += group.size();
    report.counts["octree_nodes"] += group.nodes.size();
  }
  cache.fingerprint = std::move(fingerprint);
  cache.info = make_info(scene, plan, params, cache.groups);
  cache.storage = std::make_shared<const std::vector<std::shared_ptr<const void>>>(std::move(storage));
  return cache;
}

}  // namespace nacre
