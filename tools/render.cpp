// nacre render: a picture of a scene.
#include "nacre/render/render.h"

#include <filesystem>

#include "cached_light.h"
#include "nacre/base/version.h"
#include "nacre/cache/blotch.h"
#include "nacre/cache/cache_file.h"
#include "nacre/cache/exitance_file.h"
#include "nacre/cache/fingerprint.h"
#include "nacre/render/merge_images.h"
#include "picture.h"

namespace nacre::tools {
namespace {

struct Options : RenderOptions {
  std::string output, exitance, tile;
  std::vector<std::string> cameras;
  int verify = 0;
  bool png = false;
};

// Options that have nothing to act on are mistakes.
void check_combination(const Options& options) {
  check_render_options(options);
  if (!options.tile.empty() && !options.crop.empty())
    throw UsageError("--tile and --crop both choose a part of the picture; give one");
  const Method method = method_of(options);
  if (options.verify > 0 && method != Method::kHierarchical)
    throw UsageError("--verify measures --method hierarchical; " + options.method + " has no such error");
  if (!options.exitance.empty() && (method != Method::kHierarchical || options.certified))
    throw UsageError("--exitance keeps what --method hierarchical interpolates, without --certified");
  if (!options.exitance.empty() && options.tolerance == 0.0)
    throw UsageError("--exitance keeps what is interpolated; --tolerance 0 sums up every pixel by itself");
}

// What the picture is made from where a cache is used, else an empty one that still says what it would have
// depended on.
Cache make_cache(const RenderParams& params, const World& world, const BakeParams& bake_params,
                 Session& session) {
  const Scene& scene = *world.scene;
  if (scene.media.empty()) return {};
  if (uses_cache(params.method)) return run_bake(world, bake_params, session);
  BakeConditions conditions{{}, bake_params.shadows};
  for (std::size_t m = 0; m < scene.media.size(); ++m)
    conditions.bounces.push_back(irradiance_bounces(scene, m, params.bounces));
  Cache cache;
  cache.fingerprint = make_fingerprint(scene, conditions);
  return cache;
}

// One picture: whose it is and where it goes.
struct Picture {
  std::string camera;  // "": the first
  std::string path, preview;
};

// One for each camera, with its id in the names if there are several. Fails if one cannot be written.
std::vector<Picture> plan_pictures(const Options& options) {
  std::vector<std::string> cameras = options.cameras;
  if (cameras.empty()) cameras.emplace_back();
  std::vector<Picture> pictures;
  for (const std::string& camera : cameras) {
    const std::filesystem::path output(options.output);
    std::string name = output.stem().string();
    if (cameras.size() > 1) name += "." + camera;
    std::ranges::replace(name, '/', '_');
    const auto beside = [&](const std::string& ending) {
      return std::filesystem::path(output).replace_filename(name + ending).string();
    };
    const Picture picture{camera, beside(output.extension().string()), beside(".png")};
    for (const Picture& other : pictures)
      if (other.path == picture.path)
        throw UsageError("--camera " + camera + ": two pictures would be written to " + picture.path);
    pictures.push_back(picture);
  }
  std::vector<std::string> inputs{options.scene.path, options.cache};
  if (!options.exitance.empty()) {
    check_writable(options.exitance, inputs);
    inputs.push_back(options.exitance);
  }
  for (const Picture& picture : pictures) {
    check_writable(picture.path, inputs);
    if (!options.png) continue;
    if (picture.preview == picture.path)
      throw UsageError("-o " + options.output + ": --png writes there; name the picture .exr");
    check_writable(picture.preview, inputs);
  }
  return pictures;
}

// Of all that a part of a picture depends on but which part it is.
std::string settings_digest(const Options& options, RenderParams params, const Scene& scene,
                            const Cache& cache) {
  params.crop_x = params.crop_y = params.crop_width = params.crop_height = 0;
  KeyValues conditions = make_conditions(options, params, scene, cache);
  for (const std::string& light : options.lights) conditions.emplace_back("light", light);
  conditions.emplace_back("camera", scene.cameras[params.camera].id);
  return fingerprint_digest(conditions);
}

void save_picture(const Image& image, const Picture& picture, const Options& options,
                  std::optional<double> exposure, Session& session) {
  const StageTimer timer(session.report(), "write_image");
  save_exr(image, picture.path);
  if (options.png) save_png(image, picture.preview, exposure ? *exposure : auto_exposure(image));
  session.progress().say(options.png ? picture.path + " and " + picture.preview : picture.path);
}

// `camera` is empty where there is one.
void report_verification(const Verification& verification, const std::string& camera, Session& session) {
  std::string& note = session.report().notes[camera.empty() ? "verified" : "verified, " + camera];
  if (verification.points == 0) {
    session.warn({"--verify: no pixel was found that shows a translucent surface" +
                  (camera.empty() ? "" : " (camera " + camera + ")")});
    note = "0 points: no pixel was found that shows a translucent surface";
    return;
  }
  fmt::print(
      "{}diffusion at {} points: relative RMSE {:.3f} %, largest error {:.2f} % against the exact sum\n",
      camera.empty() ? "" : camera + ": ", verification.points, 100 * verification.relative_rmse,
      100 * verification.largest);
  note = fmt::format("{} points, relative RMSE {:.6g}, largest error {:.6g}", verification.points,
                     verification.relative_rmse, verification.largest);
}

void run(const Options& options, const std::string& command_line) {
  const bool cached = uses_cache(method_of(options));
  check_combination(options);
  const std::optional<double> exposure = parse_exposure(options.exposure);
  Session session(options.common, command_line);
  const std::vector<Picture> pictures = plan_pictures(options);
  // Another kind of file is an error now, before a bake that would be in vain.
  if (!options.exitance.empty() && std::filesystem::exists(options.exitance) &&
      !is_exitance_file(options.exitance))
    load_exitance(options.exitance);

  Scene scene = load_scene(options.scene, session);
  const std::vector<Rgb> light_scales = find_light_scales(scene, options.lights);
  std::vector<RenderParams> params;
  for (const Picture& picture : pictures)
    params.push_back(make_render_params(options, scene, picture.camera, parse_share(options.tile, "--tile")));
  BakeParams bake_params = options.bake.params(options.common);
  bake_params.fixed_eta = true;  // what is not kept serves this scene alone
  session.warn(check_single_scattering(scene, options));
  if (cached && options.cache.empty() && !scene.media.empty()) plan_bake(scene, bake_params);
  std::optional<Cache> baked;
  if (!options.cache.empty() && !scene.media.empty())
    baked = load_matching_cache(options.cache, scene, bake_params.shadows, light_scales, session.report());
  scale_lights(scene, light_scales);
  const World world = [&] {
    const StageTimer timer(session.report(), "build_bvh");
    return make_world(scene, bake_params.shadows);
  }();
  const Cache cache = baked ? *std::move(baked) : make_cache(params[0], world, bake_params, session);
  if (cached) session.warn(check_density(scene, cache));

  const Renderer renderer(world, cache, params[0], session.report());
  if (!options.exitance.empty()) {
    const StageTimer timer(session.report(), "read_cache");
    renderer.load_exitance(options.exitance);
  }
  bool keeps_exitance = true;
  std::size_t kept_nodes = 0;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    Warnings warnings;
    Image image = renderer.render(params[i], session.progress(), session.report(), warnings);
    if (pictures.size() > 1)
      for (std::string& warning : warnings)
        warning += fmt::format(" (camera {})", scene.cameras[params[i].camera].id);
    session.warn(warnings);
    image.metadata = {{"nacre:version", kVersion},
                      {"nacre:command", command_line},
                      {"nacre:seed", fmt::format("{}", options.common.seed)},
                      {"nacre:fingerprint", fingerprint_digest(cache.fingerprint)}};
    if (image.width < image.full_width || image.height < image.full_height)
      image.metadata[kSettingsKey] = settings_digest(options, params[i], scene, cache);
    save_picture(image, pictures[i], options, exposure, session);
    // After each picture that adds to it: a run of many may be interrupted.
    if (const std::size_t nodes = renderer.filled_node_count();
        !options.exitance.empty() && (i == 0 || nodes > kept_nodes)) {
      const StageTimer timer(session.report(), "write_cache");
      keeps_exitance = renderer.save_exitance(options.exitance);
      kept_nodes = nodes;
    }
    if (options.verify > 0)
      report_verification(renderer.verify(params[i], options.verify),
                          pictures.size() > 1 ? scene.cameras[params[i].camera].id : "", session);
  }
  if (!keeps_exitance)
    session.warn({options.exitance +
                  " is not written: no medium here has exitance that is smooth between nodes (normalized "
                  "diffusion, samples further apart than a mean free path)"});
  session.finish();
}

}  // namespace

void add_render_command(CLI::App& app, const std::string& command_line) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("render", "Render a scene to an OpenEXR picture");
  add_scene_options(*command, options->scene);
  command->add_option("-o,--output", options->output, "OpenEXR file to write")->required();
  command
      ->add_option("--camera", options->cameras,
                   "Id of the camera (default: the first); several, one picture each, by commas or --camera "
                   "again: their ids go into the names of the pictures")
      ->check(not_empty())
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option(
      "--tile", options->tile,
      "K/N: render the K-th of N bands of the picture only; `nacre merge` puts them together");
  command->add_option("--exitance", options->exitance,
                      "Keep the diffusion that is evaluated in this file, and take it from there next time");
  command
      ->add_option(
          "--verify", options->verify,
          "Measure the error of the hierarchical sum at this many random pixels against the exact one")
      ->check(CLI::Range(1, 1 << 24));
  command->add_flag("--png", options->png, "Write an sRGB preview beside the OpenEXR file");
  add_render_options(*command, *options);
  add_bake_options(*command, options->bake);
  add_common_options(*command, options->common);
  command->callback([options, command_line] { run(*options, command_line); });
}

}  // namespace nacre::tools
