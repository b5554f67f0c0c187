// nacre sweep: many pictures of a scene from one cache.
#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "cached_light.h"
#include "contact_sheet.h"
#include "nacre/base/file.h"
#include "nacre/base/version.h"
#include "nacre/cache/cache_file.h"
#include "nacre/cache/fingerprint.h"
#include "nacre/render/merge_images.h"
#include "picture.h"
#include "shell.h"
#include "sweep_assembly.h"

namespace nacre::tools {
namespace {

// Pictures that are rendered together: what they may take, bytes a pixel of one of them, and how many.
constexpr std::size_t kBatchBytes = std::size_t{4} << 30, kPixelBytes = 220, kLargestBatch = 16;

// Renders points that share camera and lights, and so everything but what their materials make of it.
void render_batch(const SweepOptions& options, std::size_t medium, const MaterialFamilies& materials,
                  std::span<const SweepPoint* const> batch, const World& world, const ScaledCache& cache,
                  Session& session) {
  const Scene& scene = *world.scene;
  const RenderParams params = make_render_params(options, scene, batch[0]->camera);
  MaterialSweep sweep{medium, materials, {}};
  for (const SweepPoint* const point : batch)
    sweep.wanted.push_back(static_cast<std::uint32_t>(point->index));
  const Stopwatch watch;
  Warnings warnings;
  const Renderer renderer(world, cache, params, session.report(), sweep);
  std::vector<Image> images = renderer.render_sweep(params, session.progress(), session.report(), warnings);
  session.warn(warnings);
  const double share = watch.seconds() / static_cast<double>(batch.size());
  const StageTimer timer(session.report(), "write_image");
  for (std::size_t i = 0; i < batch.size(); ++i) {
    const SweepPoint& point = *batch[i];
    images[i].metadata = {{"nacre:version", kVersion},
                          {"nacre:command", describe_command(options, point)},
                          {"nacre:seed", fmt::format("{}", options.common.seed)},
                          {"nacre:fingerprint", fingerprint_digest(cache.cache.fingerprint)}};
    if (images[i].width < images[i].full_width || images[i].height < images[i].full_height)
      images[i].metadata[kSettingsKey] = point.whole;
    const std::string path = options.output + "/" + picture_name(point.index) + ".exr";
    save_exr(images[i], path);
    save_record(options.output, point.index, *point.settings,
                {point.key, bytes_digest(read_text_file(path, std::size_t{1} << 40)), share});
    std::vector<std::string> settings(point.settings->size());
    std::ranges::transform(*point.settings, settings.begin(), &describe);
    session.progress().say(fmt::format("{}: {}", path, fmt::join(settings, ", ")));
  }
}

void render_points(const SweepOptions& options, Scene& scene, std::size_t medium,
                   const MaterialFamilies& materials, const std::vector<const SweepPoint*>& points,
                   Session& session) {
  const std::vector<Medium> media = scene.media;
  const std::vector<Light> lights = scene.lights;
  World world = [&] {
    const StageTimer timer(session.report(), "build_bvh");
    return make_world(scene, !options.bake.no_shadows);
  }();
  using Group = std::pair<std::vector<std::string>, std::string>;  // lights, camera
  std::map<Group, std::vector<const SweepPoint*>> groups;
  for (const SweepPoint* const point : points) groups[{point->lights, point->camera}].push_back(point);
  const RenderParams first = make_render_params(options, scene, options.camera);
  const auto pixels =
      static_cast<std::size_t>(first.crop_width) * static_cast<std::size_t>(first.crop_height);
  const std::size_t together =
      std::clamp<std::size_t>(kBatchBytes / (pixels * kPixelBytes), 1, kLargestBatch);
  bool density_checked = false;
  std::optional<ScaledCache> cache;
  const Group* last = nullptr;
  for (auto& [group, members] : groups) {
    std::ranges::stable_sort(members, {},
                             [&](const SweepPoint* p) { return materials.places[p->index].family; });
    // Neighbouring groups mostly differ in the camera alone.
    if (!last || last->first != group.first) {
      scene.media = media;
      scene.lights = lights;
      if (!scene.media.empty()) scene.media[medium] = members[0]->material;
      const std::vector<Rgb> scales = find_light_scales(scene, group.first);
      cache.emplace(
          load_scaled_cache(options.cache, scene, !options.bake.no_shadows, scales, session.report()));
      if (!scene.media.empty()) {
        scene.media[medium] = media[medium];
        scene.media[medium].ext_ior = members[0]->material.ext_ior;
        scene.media[medium].int_ior = members[0]->material.int_ior;
      }
      scale_lights(scene, scales);
      refresh(world);
    }
    last = &group;
    if (!density_checked && !scene.media.empty()) {
      // What is finest of all that is rendered.
      const Medium kept = scene.media[medium];
      const SweepPoint& finest = **std::ranges::min_element(points, {}, [](const SweepPoint* p) {
        return smallest_mean_free_path(p->material) / p->material.scale;
      });
      scene.media[medium] = finest.material;
      scene.media[medium].place += fmt::format(": picture {}", picture_name(finest.index));
      session.warn(check_density(scene, cache->cache));
      scene.media[medium] = kept;
      density_checked = true;
    }
    for (std::size_t begin = 0; begin < members.size(); begin += together)
      render_batch(options, medium, materials,
                   std::span(members).subspan(begin, std::min(together, members.size() - begin)), world,
                   *cache, session);
  }
}

// Before anything is rendered, whether the cache serves every picture: its lights, its index of refraction,
// and its material, where light that left translucent objects was baked in.
void check_points(const SweepOptions& options, Scene& scene, std::size_t medium, Cache& cache,
                  std::span<const SweepPoint> points) {
  const bool interreflects = fingerprint_conditions(cache.fingerprint, scene.media.size()).interreflect;
  std::set<std::pair<std::vector<std::string>, float>> checked;
  for (const SweepPoint& point : points) {
    if (!checked.emplace(point.lights, point.material.eta()).second && !interreflects) continue;
    std::optional<Medium> kept;
    if (!scene.media.empty()) kept = std::exchange(scene.media[medium], point.material);
    check_cache(cache, fmt::format("{}: picture {}", options.cache, picture_name(point.index)), scene,
                !options.bake.no_shadows, find_light_scales(scene, point.lights));
    if (kept) scene.media[medium] = *kept;
  }
}

std::vector<std::string> keys_of(const std::vector<SweepPoint>& points) {
  std::vector<std::string> keys(points.size());
  std::ranges::transform(points, keys.begin(), &SweepPoint::key);
  return keys;
}

// Nothing is replaced but what a sweep has made, and nothing of that which this one reads.
void check_folder(const SweepOptions& options, const Scene& scene, std::size_t points) {
  std::vector<std::string> outputs;
  for (const char* const name : {"manifest.json", "index.html", "contact_sheet.png"})
    outputs.push_back(options.output + "/" + name);
  for (std::size_t i = 0; i < points; ++i)
    for (const char* const ending : {".exr", ".png"})
      outputs.push_back(options.output + "/" + picture_name(i) + ending);
  std::error_code ignored;
  std::erase_if(outputs, [&](const std::string& output) {
    return !std::filesystem::exists(std::filesystem::symlink_status(output, ignored));
  });
  check_apart(scene, outputs);
  for (const std::string& output : outputs) check_is_none_of(output, {options.cache, options.plan});
  if (std::filesystem::is_directory(options.output, ignored) &&
      !std::filesystem::is_directory(options.output + "/points") &&
      !std::filesystem::is_empty(options.output, ignored))
    fail(ErrorCode::kValue, options.output, "is not empty, and no folder of a sweep; name another for -o");
  if (!options.common.report_path.empty())
    check_is_none_of(options.common.report_path, {options.output + "/manifest.json"});
}

void make_folders(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder + "/points", error);
  if (error) fail(ErrorCode::kIo, folder, "the folder cannot be made: {}", error.message());
}

void run(const SweepOptions& options, const CLI::App& command, const std::string& command_line) {
  check_sweep_options(options);
  const std::optional<double> exposure = parse_exposure(options.exposure);
  const auto [shard, shards] = parse_share(options.shard, "--shard");
  const SweepPlan plan =
      options.plan.empty() ? make_plan(options.vary, options.zip) : load_plan(options.plan);
  check_sweep_keys(options, plan);
  Session session(options.common, command_line);
  Scene scene = load_scene(options.scene, session);
  session.warn(check_single_scattering(scene, options));
  const bool of_medium = std::ranges::any_of(plan.points, [](const std::vector<Setting>& point) {
    return std::ranges::any_of(point, [](const Setting& s) { return is_medium_key(s.key); });
  });
  if (of_medium && scene.media.empty())
    fail(ErrorCode::kValue, options.scene.path, "has no translucent medium to vary");
  const std::size_t medium = find_medium(scene, options.medium, of_medium);
  Body body;
  std::vector<SweepPoint> points;
  std::vector<Medium> media;
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    points.push_back(make_sweep_point(options, scene, medium, i, plan.points[i]));
    media.push_back(points.back().material);
  }
  const auto [conditions, of_whole] = [&] {
    const StageTimer timer(session.report(), "read_cache");
    Cache cache = load_cache(options.cache);
    check_points(options, scene, medium, cache, points);
    RenderParams params = make_render_params(options, scene, options.camera);
    std::array<KeyValues, 2> result{make_conditions(options, params, scene, cache)};
    params.crop_x = params.crop_y = params.crop_width = params.crop_height = 0;
    result[1] = make_conditions(options, params, scene, cache);
    if (medium < cache.groups.size() && cache.groups[medium].size() > 0)
      body = {hexagonal_spacing(cache.groups[medium]), double{cache.groups[medium].nodes[0].radius}};
    for (KeyValues& values : result) values.emplace_back("medium", options.medium);
    return result;
  }();
  const MaterialFamilies materials =
      sort_materials(media, body, mixes_eta(make_render_params(options, scene, options.camera)));
  for (SweepPoint& point : points) {
    point.key = make_sweep_key(conditions, point, materials);
    point.whole = make_sweep_key(of_whole, point, materials);
  }
  check_folder(options, scene, points.size());
  make_folders(options.output);
  const FolderClaim claim(options.output, bytes_digest(fmt::format("{}", fmt::join(keys_of(points), " "))));

  std::vector<const SweepPoint*> pending;
  std::size_t own = 0;
  for (const SweepPoint& point : points)
    if (point.index % shards == shard - 1) {
      ++own;
      if (!find_complete(options.output, point.index, point.key)) pending.push_back(&point);
    }
  if (own == 0)
    session.progress().say(
        fmt::format("--shard {}: nothing to do, there are {} pictures", options.shard, points.size()));
  session.progress().say(fmt::format(
      "{} of {} pictures to render{}", pending.size(), points.size(),
      own > pending.size() ? fmt::format(", {} are there", own - pending.size()) : std::string()));
  if (!pending.empty()) {
    const std::string manifest = options.output + "/manifest.json";
    std::filesystem::remove(manifest);  // it speaks of pictures that will be others
    if (options.engine.uses_slurm()) {
      run_on_slurm({find_words(command), options.output, keys_of(points)}, options.engine, session);
      if (std::filesystem::exists(manifest)) {  // else the job that merges failed
        session.progress().say(manifest + ", contact_sheet.png and index.html");
        return session.finish();
      }
    } else {
      render_points(options, scene, medium, materials, pending, session);
    }
  }

  std::vector<SweepRecord> records;
  for (const SweepPoint& point : points)
    if (const auto record = find_complete(options.output, point.index, point.key)) records.push_back(*record);
  if (records.size() == points.size())
    assemble_sweep(options, plan, points, records, exposure, session);
  else
    session.progress().say(
        fmt::format("{} of {} pictures are there; the shard that ends last writes the manifest",
                    records.size(), points.size()));
  session.finish();
}

}  // namespace

void add_sweep_command(CLI::App& app, const std::string& command_line) {
  auto options = std::make_shared<SweepOptions>();
  CLI::App* command = app.add_subcommand(
      "sweep",
      "Render a scene with many materials, lights or cameras from one cache, and show them together");
  add_scene_options(*command, options->scene);
  command->add_option("-o,--output", options->output, "Folder to write pictures to")
      ->required()
      ->check(not_empty());
  command
      ->add_option("--vary", options->vary,
                   "KEY=A:B:COUNT[:log] (all channels), KEY*=A:B:COUNT[:log] (times the scene's) or "
                   "KEY=v1;v2;... (numbers, r,g,b or names); KEY is sigma_a, sigma_s_prime, mfp, albedo, g, "
                   "eta, scale, "
                   "material, light.ID or camera; several make a grid")
      ->take_all();
  command->add_flag("--zip", options->zip, "Walk several --vary together instead of as a grid");
  command->add_option("--plan", options->plan, "List of points: .csv with a header of keys, or .json")
      ->check(not_empty());
  command->add_option("--medium", options->medium, "Id of the medium that varies, where there are several")
      ->check(not_empty());
  command->add_option("--camera", options->camera, "Id of the camera (default: the first)")
      ->check(not_empty());
  command
      ->add_option("--shard", options->shard,
                   "K/N: render every N-th picture only, from the K-th on; the last one assembles them")
      ->check(not_empty());
  add_render_options(*command, *options);
  command->get_option("--cache")->description("Cache that `nacre bake` made")->required();
  command->get_option("--method")
      ->description("Diffusion: hierarchical (default) or exact sum over the cache");
  command->add_flag("--no-shadows", options->bake.no_shadows, "As the cache was baked");
  add_common_options(*command, options->common);
  add_engine_options(*command, options->engine);
  command->callback([options, command, command_line] {
    options->words =
        option_words(*command, {"output", "vary", "zip", "plan", "shard", "exposure", "threads", "simd",
                                "quiet", "report", "engine", "shards", "retries", "slurm-option"});
    run(*options, *command, command_line);
  });
}

}  // namespace nacre::tools
