// nacre sweep: many pictures of a scene from one cache.
#include <algorithm>
#include <charconv>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "cached_light.h"
#include "contact_sheet.h"
#include "nacre/base/file.h"
#include "nacre/base/version.h"
#include "nacre/cache/cache_file.h"
#include "nacre/cache/fingerprint.h"
#include "nacre/cache/material_family.h"
#include "picture.h"
#include "sweep_record.h"
#include "sweep_slurm.h"

namespace nacre::tools {
namespace {

// Pictures that are rendered together: what they may take, bytes a pixel of one of them, and how many.
constexpr std::size_t kBatchBytes = std::size_t{4} << 30, kPixelBytes = 220, kLargestBatch = 16;
constexpr int kThumbnailEdge = 256;

struct Options : RenderOptions {
  std::vector<std::string> vary;
  std::string plan, medium, camera, output, shard;
  EngineOptions engine;
  bool zip = false;
};

// One point of the plan, and what it makes of the scene.
struct Point {
  std::size_t index;
  const std::vector<Setting>* settings;
  std::string camera;
  std::vector<std::string> lights;  // arguments of --light
  Medium material;
  std::string key;
};

void check_options(const Options& options) {
  check_render_options(options);
  if (options.vary.empty() == options.plan.empty())
    throw UsageError("give either --vary KEY=... or --plan FILE");
  if (options.zip && options.vary.size() < 2) throw UsageError("--zip walks several --vary together");
  if (!uses_cache(method_of(options)))
    throw UsageError("--method " + options.method + ": a sweep is made from a cache");
  if (options.engine.uses_slurm() && !options.shard.empty())
    throw UsageError("--shard K/N is for one machine; --engine slurm gives every job its own");
  check_engine_options(options.engine);
}

std::size_t find_medium(const Scene& scene, const std::string& id, bool needed) {
  if (id.empty()) {
    if (needed && scene.media.size() != 1)
      throw UsageError(
          fmt::format("the scene has {} media; --medium ID says which of them varies", scene.media.size()));
    return 0;
  }
  std::string ids;
  for (std::size_t m = 0; m < scene.media.size(); ++m) {
    if (medium_name(scene, m) == id) return m;
    ids += (m > 0 ? ", '" : "'") + medium_name(scene, m) + "'";
  }
  fail(ErrorCode::kValue, "--medium", "no medium has the id '{}'; there is {}", id,
       ids.empty() ? "none" : ids);
}

Point make_point(const Options& options, const Scene& scene, std::size_t medium, std::size_t index,
                 const std::vector<Setting>& settings) {
  Point point{index, &settings, options.camera, options.lights, {}, ""};
  if (!scene.media.empty()) point.material = scene.media[medium];
  std::vector<Setting> of_medium;
  for (const Setting& setting : settings) {
    if (setting.key == "camera")
      point.camera = setting.value;
    else if (setting.key.starts_with("light."))
      point.lights.push_back(setting.key.substr(6) + "=" + setting.value);
    else
      of_medium.push_back(setting);
  }
  std::ranges::stable_sort(of_medium, {}, [](const Setting& s) { return setting_order(s.key); });
  const std::string place =
      (options.plan.empty() ? "--vary" : options.plan) + std::string(": point ") + std::to_string(index + 1);
  check_settings(of_medium, place);
  for (const Setting& setting : of_medium) apply_setting(point.material, setting, place);
  if (!of_medium.empty() && max_channel(point.material.sigma_s + point.material.sigma_a) == 0)
    fail(ErrorCode::kValue, place, "the medium neither scatters nor absorbs");
  if (!point.camera.empty()) find_camera(scene, point.camera, place);
  find_light_scales(scene, point.lights, place);
  return point;
}

std::string make_key(KeyValues conditions, const Point& point, const MaterialFamilies& materials) {
  conditions.emplace_back("refined for", materials.digests[materials.places[point.index].family]);
  for (const Setting& setting : *point.settings)
    conditions.emplace_back(setting.key + (setting.relative ? "*" : ""), setting.value);
  for (const std::string& light : point.lights) conditions.emplace_back("light", light);
  conditions.emplace_back("camera", point.camera);
  return fingerprint_digest(conditions);
}

// The command that makes one point's picture: the same for every shard and every way to it.
std::string describe_command(const Options& options, const Point& point) {
  std::string text = "nacre sweep " + options.scene.path + " --cache " + options.cache;
  for (const Setting& setting : *point.settings)
    text += " --vary " + setting.key + (setting.relative ? "*=" : "=") + setting.value;
  return text;
}

// Renders points that share camera, lights and eta, and so everything but what their materials make of it.
void render_batch(const Options& options, std::size_t medium, const MaterialFamilies& materials,
                  std::span<const Point* const> batch, const World& world, const Cache& cache,
                  Session& session) {
  const Scene& scene = *world.scene;
  const RenderParams params = make_render_params(options, scene, batch[0]->camera);
  MaterialSweep sweep{medium, materials, {}};
  for (const Point* const point : batch) sweep.wanted.push_back(static_cast<std::uint32_t>(point->index));
  const Stopwatch watch;
  Warnings warnings;
  const Renderer renderer(world, cache, params, session.report(), sweep);
  std::vector<Image> images = renderer.render_sweep(params, session.progress(), session.report(), warnings);
  session.warn(warnings);
  const double share = watch.seconds() / static_cast<double>(batch.size());
  const StageTimer timer(session.report(), "write_image");
  for (std::size_t i = 0; i < batch.size(); ++i) {
    const Point& point = *batch[i];
    images[i].metadata = {{"nacre:version", kVersion},
                          {"nacre:command", describe_command(options, point)},
                          {"nacre:seed", fmt::format("{}", options.common.seed)},
                          {"nacre:fingerprint", fingerprint_digest(cache.fingerprint)}};
    const std::string path = options.output + "/" + picture_name(point.index) + ".exr";
    save_exr(images[i], path);
    save_record(options.output, point.index, *point.settings,
                {point.key, bytes_digest(read_text_file(path, std::size_t{1} << 40)), share});
    std::vector<std::string> settings(point.settings->size());
    std::ranges::transform(*point.settings, settings.begin(), &describe);
    session.progress().say(fmt::format("{}: {}", path, fmt::join(settings, ", ")));
  }
}

void render_points(const Options& options, Scene& scene, std::size_t medium,
                   const MaterialFamilies& materials, const std::vector<const Point*>& points,
                   Session& session) {
  const std::vector<Medium> media = scene.media;
  const std::vector<Light> lights = scene.lights;
  World world = [&] {
    const StageTimer timer(session.report(), "build_bvh");
    return make_world(scene, !options.bake.no_shadows);
  }();
  using Group = std::tuple<std::vector<std::string>, float, std::string>;
  std::map<Group, std::vector<const Point*>> groups;
  for (const Point* const point : points)
    groups[{point->lights, point->material.eta(), point->camera}].push_back(point);
  const RenderParams first = make_render_params(options, scene, options.camera);
  const auto pixels =
      static_cast<std::size_t>(first.crop_width) * static_cast<std::size_t>(first.crop_height);
  const std::size_t together =
      std::clamp<std::size_t>(kBatchBytes / (pixels * kPixelBytes), 1, kLargestBatch);
  bool density_checked = false;
  std::optional<Cache> cache;
  const Group* last = nullptr;
  for (auto& [group, members] : groups) {
    std::ranges::stable_sort(members, {}, [&](const Point* p) { return materials.places[p->index].family; });
    // Neighbouring groups mostly differ in the camera alone.
    if (!last || std::get<0>(*last) != std::get<0>(group) || std::get<1>(*last) != std::get<1>(group)) {
      scene.media = media;
      scene.lights = lights;
      if (!scene.media.empty()) {
        scene.media[medium].ext_ior = members[0]->material.ext_ior;
        scene.media[medium].int_ior = members[0]->material.int_ior;
      }
      const std::vector<Rgb> scales = find_light_scales(scene, std::get<0>(group));
      cache.emplace(
          load_matching_cache(options.cache, scene, !options.bake.no_shadows, scales, session.report()));
      scale_lights(scene, scales);
      refresh(world);
    }
    last = &group;
    if (!density_checked && !scene.media.empty()) {
      // What is finest of all that is rendered.
      const Medium kept = scene.media[medium];
      scene.media[medium] = (*std::ranges::min_element(points, {}, [](const Point* p) {
                              return smallest_mean_free_path(p->material) / p->material.scale;
                            }))->material;
      session.warn(check_density(scene, *cache));
      scene.media[medium] = kept;
      density_checked = true;
    }
    for (std::size_t begin = 0; begin < members.size(); begin += together)
      render_batch(options, medium, materials,
                   std::span(members).subspan(begin, std::min(together, members.size() - begin)), world,
                   *cache, session);
  }
}

// A float as it is read, without the digits that a double adds.
double shortest(float value) {
  double result = 0;
  const std::string text = fmt::format("{}", value);
  std::from_chars(text.data(), text.data() + text.size(), result);
  return result;
}

// Previews at one exposure, the sheet, the page and the manifest, once every picture is there.
void assemble(const Options& options, const SweepPlan& plan, const std::vector<Point>& points,
              const std::vector<SweepRecord>& records, std::optional<double> exposure, Session& session) {
  const StageTimer timer(session.report(), "write_image");
  const auto file_of = [&](const Point& point, const char* ending) {
    return picture_name(point.index) + ending;
  };
  if (!exposure) {
    exposure = 1e3;
    for (const Point& point : points)
      exposure = std::min(*exposure, auto_exposure(load_exr(options.output + "/" + file_of(point, ".exr"))));
  }
  std::vector<SheetPicture> pictures(points.size());
  parallel_for(points.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Image image = load_exr(options.output + "/" + file_of(points[i], ".exr"));
      save_png(image, options.output + "/" + file_of(points[i], ".png"), *exposure);
      pictures[i] = {file_of(points[i], ".png"), *points[i].settings,
                     make_preview(shrink(image, kThumbnailEdge), options.output, *exposure)};
    }
  });
  nlohmann::ordered_json manifest;
  manifest["nacre"] = kVersion;
  manifest["scene"] = options.scene.path;
  manifest["cache"] = options.cache;
  manifest["exposure"] = *exposure;
  for (const SweepAxis& axis : plan.axes) {
    nlohmann::ordered_json values;
    for (const Setting& value : axis.values) values.push_back(value.value);
    manifest["axes"].push_back({{"name", axis.name}, {"values", values}});
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point& point = points[i];
    nlohmann::ordered_json entry;
    for (const Setting& setting : *point.settings)
      entry["settings"][setting.key + (setting.relative ? "*" : "")] = setting.value;
    const auto triple = [](const Rgb& v) {
      return nlohmann::ordered_json{shortest(v.x), shortest(v.y), shortest(v.z)};
    };
    entry["coefficients"] = {{"sigma_s_prime", triple(reduce(point.material).sigma_s_prime)},
                             {"sigma_a", triple(point.material.sigma_a)},
                             {"g", triple(point.material.g)},
                             {"eta", shortest(point.material.eta())},
                             {"scale", shortest(point.material.scale)}};
    entry["exr"] = file_of(point, ".exr");
    entry["png"] = file_of(point, ".png");
    entry["xxh3"] = records[i].digest;
    entry["key"] = records[i].key;
    entry["seconds"] = records[i].seconds;
    manifest["pictures"].push_back(entry);
  }
  const auto write = [&](const std::string& name, const auto& bytes) {
    AtomicFile file(options.output + "/" + name);
    file.write(bytes.data(), bytes.size());
    file.commit();
  };
  write("contact_sheet.png", encode_png(make_contact_sheet(plan, pictures), options.output));
  write("index.html", make_sweep_page(plan, pictures, options.scene.path));
  write("manifest.json", manifest.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
  session.progress().say(options.output + "/manifest.json, contact_sheet.png and index.html");
  std::size_t end = points.size();
  while (std::filesystem::exists(options.output + "/" + picture_name(end) + ".exr")) ++end;
  if (end > points.size())
    session.warn(
        {fmt::format("{}: pictures {} to {} are of an earlier sweep, the manifest does not name them",
                     options.output, picture_name(points.size()), picture_name(end - 1))});
}

std::vector<std::string> keys_of(const std::vector<Point>& points) {
  std::vector<std::string> keys(points.size());
  std::ranges::transform(points, keys.begin(), &Point::key);
  return keys;
}

void make_folders(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder + "/points", error);
  if (error) fail(ErrorCode::kIo, folder, "the folder cannot be made: {}", error.message());
}

void run(const Options& options, const CLI::App& command, const std::string& command_line) {
  check_options(options);
  const std::optional<double> exposure = parse_exposure(options.exposure);
  const auto [shard, shards] = parse_share(options.shard, "--shard");
  const SweepPlan plan =
      options.plan.empty() ? make_plan(options.vary, options.zip) : load_plan(options.plan);
  Session session(options.common, command_line);
  Scene scene = load_scene(options.scene, session);
  session.warn(check_single_scattering(scene, options));
  const bool of_medium = std::ranges::any_of(plan.points, [](const std::vector<Setting>& point) {
    return std::ranges::any_of(point, [](const Setting& s) { return is_medium_key(s.key); });
  });
  if (of_medium && scene.media.empty())
    fail(ErrorCode::kValue, options.scene.path, "has no translucent medium to vary");
  const std::size_t medium = find_medium(scene, options.medium, of_medium);
  const KeyValues conditions = [&] {
    const StageTimer timer(session.report(), "read_cache");
    KeyValues result = make_conditions(options, make_render_params(options, scene, options.camera), scene,
                                       load_cache(options.cache));
    result.emplace_back("medium", options.medium);
    return result;
  }();
  std::vector<Point> points;
  std::vector<Medium> media;
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    points.push_back(make_point(options, scene, medium, i, plan.points[i]));
    media.push_back(points.back().material);
  }
  const MaterialFamilies materials = sort_materials(media);
  for (Point& point : points) point.key = make_key(conditions, point, materials);
  for (const Point& point : points) {
    const std::string picture = options.output + "/" + picture_name(point.index);
    check_apart(scene, {picture + ".exr", picture + ".png"});
  }
  make_folders(options.output);

  std::vector<const Point*> pending;
  std::size_t own = 0;
  for (const Point& point : points)
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
  for (const Point& point : points)
    if (const auto record = find_complete(options.output, point.index, point.key)) records.push_back(*record);
  if (records.size() == points.size())
    assemble(options, plan, points, records, exposure, session);
  else
    session.progress().say(
        fmt::format("{} of {} pictures are there; the shard that ends last writes the manifest",
                    records.size(), points.size()));
  session.finish();
}

}  // namespace

void add_sweep_command(CLI::App& app, const std::string& command_line) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "sweep",
      "Render a scene with many materials, lights or cameras from one cache, and show them together");
  add_scene_options(*command, options->scene);
  command->add_option("-o,--output", options->output, "Folder to write pictures to")->required();
  command
      ->add_option("--vary", options->vary,
                   "KEY=A:B:COUNT[:log] (all channels), KEY*=A:B:COUNT[:log] (times the scene's) or "
                   "KEY=v1;v2;... (numbers, r,g,b or names); KEY is sigma_a, sigma_s_prime, mfp, albedo, g, "
                   "eta, scale, "
                   "material, light.ID or camera; several make a grid")
      ->take_all();
  command->add_flag("--zip", options->zip, "Walk several --vary together instead of as a grid");
  command->add_option("--plan", options->plan, "List of points: .csv with a header of keys, or .json");
  command->add_option("--medium", options->medium, "Id of the medium that varies, where there are several");
  command->add_option("--camera", options->camera, "Id of the camera (default: the first)")
      ->check(not_empty());
  command->add_option("--shard", options->shard,
                      "K/N: render every N-th picture only, from the K-th on; the last one assembles them");
  add_render_options(*command, *options);
  command->get_option("--cache")->required();
  command->add_flag("--no-shadows", options->bake.no_shadows, "As the cache was baked");
  add_common_options(*command, options->common);
  add_engine_options(*command, options->engine);
  command->callback([options, command, command_line] { run(*options, *command, command_line); });
}

}  // namespace nacre::tools
