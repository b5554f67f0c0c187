// nacre info: what a file holds, and whether it is sound.
#include <algorithm>
#include <filesystem>

#include "common.h"
#include "nacre/cache/blotch.h"
#include "nacre/cache/cache_file.h"
#include "nacre/cache/exitance_file.h"
#include "nacre/cache/fingerprint.h"
#include "nacre/cache/relight.h"
#include "nacre/geometry/mesh_file.h"
#include "nacre/geometry/topology.h"
#include "nacre/render/image_file.h"
#include "nacre/scene/validity.h"

namespace nacre::tools {
namespace {

struct Options {
  CommonOptions common;
  SceneOptions scene;
  bool check = false;
};

std::string vector_text(const Vec3& v) { return fmt::format("{:.4g} {:.4g} {:.4g}", v.x, v.y, v.z); }

void print_topology(const TopologyReport& r, const char* indent) {
  fmt::print("{}{} triangles, {} vertices, {} pieces\n", indent, r.triangles, r.vertices, r.components);
  fmt::print("{}size {}, area {:.6g}", indent, vector_text(r.box.isEmpty() ? Vec3(0, 0, 0) : r.box.size()),
             r.area);
  if (r.closed()) fmt::print(", volume {:.6g}", r.volume);
  fmt::print("\n{}{}\n", indent,
             r.closed()
                 ? "closed"
                 : fmt::format("open: {} boundary edges in {} loops", r.boundary_edges, r.boundary_loops));
  fmt::print("{}non-manifold edges {}, flipped edges {}, duplicate faces {}, degenerate triangles {}\n",
             indent, r.non_manifold_edges, r.flipped_edges, r.duplicate_faces, r.degenerate_triangles);
}

// Returns whether anything is wrong.
bool show_mesh(const std::string& path) {
  Warnings warnings;
  const Mesh mesh = load_mesh(path, warnings);
  const TopologyReport report = analyse_topology(mesh);
  fmt::print("mesh {}\n", path);
  print_topology(report, "  ");
  const std::string problems = describe_problems(report);
  if (!problems.empty()) warnings.push_back(path + ": " + problems);
  for (const std::string& warning : warnings) fmt::print("  warning: {}\n", one_line(warning));
  return !warnings.empty();
}

void show_density(const CacheGroup& group, double mm_per_unit) {
  const double spacing = hexagonal_spacing(group) * mm_per_unit;
  fmt::print("  spacing {:.4g} mm: serves mean free paths down to {:.3g} mm\n", spacing,
             spacing / spacing_for_blotch(kAcceptableBlotch));
}

void show_exitance(const std::string& path) {
  const std::vector<KeptExitance> media = load_exitance(path);
  fmt::print("exitance {}: format version {}, sound\n", path, kExitanceVersion);
  for (const KeptExitance& kept : media) {
    if (kept.key.empty()) {
      fmt::print("a medium of which nothing is kept\n");
      continue;
    }
    const auto filled = std::ranges::count(kept.filled, 1);
    fmt::print("{} nodes in {} blocks, {} of them evaluated; made for\n", kept.values.size(),
               kept.filled.size(), filled);
    for (const auto& [key, value] : kept.key) fmt::print("  {}: {}\n", one_line(key), one_line(value));
  }
}

// The standard errors of samples: what they come to in the mean of all, and the worst of one that is not
// dark.
void show_lights(const CacheGroup& group, double mean_irradiance) {
  if (group.lights.empty()) return;
  std::string names;
  bool errors = true, ratios = true;
  for (const LightPlane& light : group.lights) {
    if (!light.name.empty()) names += (names.empty() ? "'" : ", '") + light.name + "'";
    errors = errors && !light.errors.empty();
    ratios = ratios && !light.ratios.empty();
  }
  fmt::print(
      "  lights {}; for {}\n", names.empty() ? "together" : "apart: " + names,
      ratios ? fmt::format("eta {} to {}", kLeastEta, kMostEta) : fmt::format("eta {:.6g}", group.eta));
  if (!errors) {
    fmt::print("  standard error of the irradiance not known (one irradiance sample)\n");
    return;
  }
  std::vector<float> relative;
  for (std::size_t i = 0; i < group.size(); ++i)
    if (const double e = double{mean_channel(group.irradiance(i))}; e > 0.01 * mean_irradiance)
      relative.push_back(static_cast<float>(double{irradiance_error(group, i)} / e));
  if (relative.empty()) return;
  std::ranges::sort(relative);
  const auto at = [&](double share) {
    return 100 * double{relative[static_cast<std::size_t>(share * static_cast<double>(relative.size() - 1))]};
  };
  fmt::print(
      "  standard error of the irradiance: {:.3g} % of it (median), {:.3g} % (one sample in a hundred "
      "exceeds "
      "it), {:.3g} % at most\n",
      at(0.5), at(0.99), at(1));
}

void show_group(const CacheGroup& group, const KeyValues& info) {
  fmt::print("group {}\n", one_line(group.name));
  fmt::print("  {} samples, {} octree nodes, surface {:.6g} scene units^2\n", group.size(),
             group.nodes.size(), group.surface_area);
  double mm_per_unit = 1;
  for (const auto& [key, value] : info)
    if (key == "group " + group.name + "/mm_per_unit") mm_per_unit = std::strtod(value.c_str(), nullptr);
  if (group.size() == 0) return;
  show_density(group, mm_per_unit);
  double area = 0;
  std::array<double, 3> power{};
  float least = group.area(0), most = least;
  std::size_t dark = 0;
  for (std::size_t i = 0; i < group.size(); ++i) {
    const float a = group.area(i);
    const Rgb e = group.irradiance(i);
    area += a;
    least = std::min(least, a);
    most = std::max(most, a);
    dark += is_black(e);
    for (int k = 0; k < 3; ++k) power[static_cast<std::size_t>(k)] += static_cast<double>(a) * e[k];
  }
  const double mean = area / static_cast<double>(group.size());
  fmt::print("  shares add up to {:.4f} of the surface; from {:.3g} to {:.3g} of their mean\n",
             area / group.surface_area, least / mean, most / mean);
  fmt::print("  mean transmitted irradiance {:.5g} {:.5g} {:.5g}; {:.1f} % of the samples are dark\n",
             power[0] / area, power[1] / area, power[2] / area,
             100.0 * static_cast<double>(dark) / static_cast<double>(group.size()));
  show_lights(group, (power[0] + power[1] + power[2]) / (3 * area));
}

void show_cache(const std::string& path) {
  std::uint32_t version = 0;
  const Cache cache = load_cache(path, &version);
  fmt::print("cache {}: format version {}, sound\n", path, version);
  for (const CacheGroup& group : cache.groups) show_group(group, cache.info);
  fmt::print("recorded\n");
  for (const auto& [key, value] : cache.info) fmt::print("  {}: {}\n", one_line(key), one_line(value));
  fmt::print("depends on (fingerprint {})\n", fingerprint_digest(cache.fingerprint));
  for (const auto& [key, value] : cache.fingerprint) fmt::print("  {}: {}\n", one_line(key), one_line(value));
}

// Returns whether a value is no number, or not what was written.
bool show_image(const std::string& path) {
  const Image image = load_exr(path);
  fmt::print("image {}: {}x{}", path, image.full_width, image.full_height);
  if (image.width != image.full_width || image.height != image.full_height)
    fmt::print(", of which {}x{} from ({}, {})", image.width, image.height, image.x, image.y);
  fmt::print("\n");
  for (const Channel& channel : image.channels) {
    const auto [low, high] = std::minmax_element(channel.values.begin(), channel.values.end());
    double sum = 0;
    for (const float v : channel.values) sum += v;
    fmt::print("  {:<12} mean {:.5g}, from {:.5g} to {:.5g}\n", one_line(channel.name),
               sum / static_cast<double>(channel.values.size()), *low, *high);
  }
  for (const auto& [key, value] : image.metadata) fmt::print("  {}: {}\n", one_line(key), one_line(value));
  bool flawed = check_seal(image) == Seal::kBroken;
  if (flawed) fmt::print("  is not as nacre wrote it: damaged, or changed by another program\n");
  for (const Channel& channel : image.channels) {
    const BadValues bad = find_bad_values(image, channel);
    if (bad.count == 0) continue;
    fmt::print("  channel {} is NaN or infinite, first at pixel ({}, {})\n", channel.name, bad.x, bad.y);
    flawed = true;
  }
  return flawed;
}

bool show_scene(const SceneOptions& options, Session& session) {
  const Scene scene = load_scene(options, session);
  fmt::print("scene {}: {} shapes, {} media, {} lights, {} cameras\n", options.path, scene.shapes.size(),
             scene.media.size(), scene.lights.size(), scene.cameras.size());
  const Warnings bodies = check_bodies(scene);
  session.warn(bodies);
  bool flawed = !scene.warnings.empty() || !bodies.empty();
  for (const Shape& shape : scene.shapes) {
    fmt::print("shape {} ({}, {})\n", one_line(shape.id), shape.type, shape.place);
    if (shape.medium != kNone)
      fmt::print("  translucent: {}\n", one_line(medium_name(scene, static_cast<std::size_t>(shape.medium))));
    print_topology(analyse_topology(shape.mesh), "  ");
  }
  for (std::size_t m = 0; m < scene.media.size(); ++m) {
    const Medium& medium = scene.media[m];
    const Reduced reduced = reduce(medium);
    const MediumExtent extent = measure_medium(scene, m);
    const float length = smallest_mean_free_path(medium);
    fmt::print("medium {} ({}){}\n", one_line(medium_name(scene, m)), medium.place,
               medium.material.empty() ? "" : ": " + medium.material);
    fmt::print("  sigma_s' {} 1/mm, sigma_a {} 1/mm, g {}, eta {:.4g}\n", vector_text(reduced.sigma_s_prime),
               vector_text(medium.sigma_a), vector_text(medium.g), medium.eta());
    fmt::print("  mean free path l' {} mm\n", vector_text(reduced.mean_free_path));
    fmt::print("  size {} mm, {} of the smallest l'; thickness {:.3g} mm, {:.3g} l'\n",
               vector_text(extent.size_mm), vector_text(extent.size_mm / length), extent.thickness_mm,
               extent.thickness_mm / length);
  }
  if (!scene.media.empty()) {
    const BakePlan plan = plan_bake(scene, {});
    for (const GroupPlan& group : plan.groups)
      fmt::print("bake {}: about {:.0f} samples, {:.3g} mm apart\n", group.name, group.points,
                 group.spacing_mm);
    fmt::print("cache: about {}\n", format_bytes(plan.bytes));
  }
  for (std::size_t i = 0; i < scene.lights.size(); ++i)
    fmt::print("light {} ({})\n", light_name(scene, i), scene.lights[i].place);
  for (const Camera& camera : scene.cameras) fmt::print("camera {} ({})\n", camera.id, camera.place);
  return flawed;
}

void run(const Options& options, const std::string& command_line) {
  Session session(options.common, command_line);
  const std::string& path = options.scene.path;
  const std::string extension = std::filesystem::path(path).extension().string();
  bool flawed = false;
  if (is_exitance_file(path))
    show_exitance(path);
  else if (is_cache_file(path) || extension == ".nacre")
    show_cache(path);
  else if (extension == ".exr" || extension == ".EXR")
    flawed = show_image(path);
  else if (is_mesh_file_name(path) && options.scene.material.empty() && !options.scene.height)
    flawed = show_mesh(path);
  else
    flawed = show_scene(options.scene, session);
  session.finish();
  if (options.check && flawed) fail(ErrorCode::kValue, path, "has the problems above");
}

}  // namespace

void add_info_command(CLI::App& app, const std::string& command_line) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "info", "Say what a scene, mesh, cache, file of exitance or image holds and whether it is sound");
  add_scene_options(*command, options->scene);
  command->add_flag("--check", options->check, "Exit with 1 when something is wrong with it");
  add_common_options(*command, options->common);
  command->callback([options, command_line] { run(*options, command_line); });
}

}  // namespace nacre::tools
