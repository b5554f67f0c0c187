// nacre render: a picture of a scene.
#include "nacre/render/render.h"

#include <charconv>
#include <filesystem>

#include "cached_light.h"
#include "common.h"
#include "nacre/base/version.h"
#include "nacre/cache/blotch.h"
#include "nacre/cache/cache_file.h"
#include "nacre/cache/exitance_file.h"
#include "nacre/cache/fingerprint.h"

namespace nacre::tools {
namespace {

struct Options {
  CommonOptions common;
  SceneOptions scene;
  BakeOptions bake;
  std::string output, cache, exitance, size, crop, method = "hierarchical", aovs = "all", exposure = "0";
  std::vector<std::string> cameras, lights;
  int samples_per_pixel = 0;
  std::optional<double> tolerance;
  std::optional<int> single_samples, mc_samples;
  std::optional<std::string> mc_sampling;
  int verify = 0;
  bool png = false, certified = false;
};

// In the order of Method.
const std::vector<std::string> kMethods{"hierarchical", "exact", "montecarlo", "lambert"};
Method method_of(const Options& options) {
  return static_cast<Method>(std::find(kMethods.begin(), kMethods.end(), options.method) - kMethods.begin());
}

AovSelection parse_aovs(const std::string& text) {
  if (text == "all") return {};
  AovSelection selection{false, false, false, false, false, false, false};
  if (text == "none") return selection;
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string name = text.substr(begin, end - begin);
    if (name == "layers")
      selection.layers = true;
    else if (name == "position")
      selection.position = true;
    else if (name == "normal")
      selection.normal = true;
    else if (name == "depth")
      selection.depth = true;
    else if (name == "object")
      selection.object_id = true;
    else if (name == "irradiance")
      selection.irradiance = true;
    else if (name == "irradiance_error")
      selection.irradiance_error = true;
    else
      throw UsageError("--aov " + name +
                       ": use none, all, or a list of layers, position, normal, depth, object, irradiance, "
                       "irradiance_error");
    begin = end + 1;
  }
  return selection;
}

// "X,Y,WxH"
void parse_crop(const std::string& text, RenderParams& params) {
  const auto first = text.find(','), second = text.find(',', first == std::string::npos ? first : first + 1);
  int x = -1, y = -1;
  if (second != std::string::npos) {
    char rest = 0;
    if (std::sscanf(text.substr(0, second + 1).c_str(), "%d,%d%c", &x, &y, &rest) != 3) x = -1;
  }
  if (x < 0 || y < 0)
    throw UsageError("--crop " + text + ": write it as X,Y,WIDTHxHEIGHT in pixels from the top left");
  const auto size = parse_size(text.substr(second + 1), "--crop");
  if (x > params.width - size[0] || y > params.height - size[1])
    throw UsageError(
        fmt::format("--crop {}: reaches outside the picture of {}x{}", text, params.width, params.height));
  params.crop_x = x;
  params.crop_y = y;
  params.crop_width = size[0];
  params.crop_height = size[1];
}

RenderParams make_params(const Options& options, const Scene& scene, const std::string& id) {
  const std::size_t camera = id.empty() ? 0 : find_camera(scene, id, "--camera");
  RenderParams params = default_render_params(scene, camera);
  if (!options.size.empty()) {
    const auto size = parse_size(options.size, "--size");
    params.width = params.crop_width = size[0];
    params.height = params.crop_height = size[1];
  }
  if (!options.crop.empty()) parse_crop(options.crop, params);
  if (std::int64_t{params.crop_width} * params.crop_height > (std::int64_t{1} << 28))
    throw UsageError("the picture has more than 2^28 pixels; render it in parts with --crop");
  if (options.samples_per_pixel > 0) params.samples_per_pixel = options.samples_per_pixel;
  params.method = method_of(options);
  if (options.tolerance) params.tolerance = *options.tolerance;
  params.certified = options.certified;
  if (options.single_samples) params.single_samples = *options.single_samples;
  if (options.mc_samples) params.mc_samples = *options.mc_samples;
  if (options.mc_sampling == "uniform") params.mc_sampling = MonteCarloSampling::kUniform;
  params.bounces = options.bake.bounces;
  params.seed = options.common.seed;
  params.aovs = parse_aovs(options.aovs);
  return params;
}

std::optional<double> parse_exposure(const std::string& text) {
  if (text == "auto") return std::nullopt;
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(std::abs(value) <= 100))
    throw UsageError("--exposure " + text + ": give a number of stops between -100 and 100, or auto");
  return value;
}

// Options that have nothing to act on are mistakes.
void check_combination(const Options& options) {
  const Method method = method_of(options);
  if (!options.cache.empty() && options.bake.any_but_shadows())
    throw UsageError(
        "--points, --spacing, --irradiance-samples, --irradiance-error, --bounces and --interreflect are for "
        "baking; --cache is "
        "baked already");
  const bool samples_cache = options.bake.points || options.bake.spacing || options.bake.irradiance_samples ||
                             options.bake.interreflect || options.bake.irradiance_error;
  if (!uses_cache(method) && (!options.cache.empty() || samples_cache))
    throw UsageError(
        fmt::format("--method {} uses no cache: leave out --cache, --points, --spacing, "
                    "--irradiance-samples, --irradiance-error and --interreflect",
                    options.method));
  if ((options.mc_samples || options.mc_sampling) && method != Method::kMonteCarlo)
    throw UsageError("--mc-samples and --mc-sampling go with --method montecarlo");
  if (options.verify > 0 && method != Method::kHierarchical)
    throw UsageError("--verify measures --method hierarchical; " + options.method + " has no such error");
  if (options.certified && method != Method::kHierarchical)
    throw UsageError("--certified is for --method hierarchical; " + options.method + " has no tolerance");
  if (!options.exitance.empty() && (method != Method::kHierarchical || options.certified))
    throw UsageError("--exitance keeps what --method hierarchical interpolates, without --certified");
  if (options.tolerance && method != Method::kHierarchical)
    throw UsageError("--tolerance is that of --method hierarchical; " + options.method + " has none");
  if (!options.exitance.empty() && options.tolerance == 0.0)
    throw UsageError("--exitance keeps what is interpolated; --tolerance 0 sums up every pixel by itself");
  const AovSelection aovs = parse_aovs(options.aovs);
  if ((aovs.irradiance || aovs.irradiance_error) && !uses_cache(method))
    throw UsageError("--aov irradiance shows the samples of a cache, and --method " + options.method +
                     " uses none");
  if (options.single_samples.value_or(0) > 0 && method == Method::kLambert)
    throw UsageError("--single-samples: an opaque surface, as --method lambert takes it, has no inside");
}

// Media in which no light is traced that scatters once, where that was asked for.
Warnings check_single_scattering(const Scene& scene, const Options& options) {
  Warnings warnings;
  if (options.single_samples.value_or(0) == 0) return warnings;
  for (std::size_t m = 0; m < scene.media.size(); ++m) {
    const Medium& medium = scene.media[m];
    const char* const reason = medium.lambert ? "is taken for an opaque surface (lambert)"
                               : medium.profile == ProfileKind::kNormalized
                                   ? "has a profile that contains single scattering"
                                   : nullptr;
    if (reason)
      warnings.push_back(fmt::format("{}: {} {}: --single-samples has no effect on it", medium.place,
                                     medium_label(scene, m), reason));
  }
  return warnings;
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
  for (const Picture& picture : pictures) params.push_back(make_params(options, scene, picture.camera));
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
  command->add_option("--cache", options->cache, "Cache that `nacre bake` made (default: bake in memory)");
  command
      ->add_option("--camera", options->cameras,
                   "Id of the camera (default: the first); several, one picture each, by commas or --camera "
                   "again: their ids go into the names of the pictures")
      ->check(not_empty())
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option("--size", options->size, "WIDTHxHEIGHT of the picture (default: the film's)");
  command->add_option("--crop", options->crop, "X,Y,WIDTHxHEIGHT: render this part of the picture only");
  command->add_option("--spp", options->samples_per_pixel, "Samples per pixel (default: the sampler's)")
      ->check(CLI::Range(1, 1 << 16));
  command
      ->add_option(
          "--method", options->method,
          "Diffusion: hierarchical (default) or exact sum over the cache, montecarlo without one, or "
          "lambert, its approximation as an opaque surface")
      ->check(CLI::IsMember(kMethods));
  command
      ->add_option("--tolerance", options->tolerance,
                   "Relative error of the hierarchical sum (default: 0.01)")
      ->check(CLI::Range(0.0, 1.0))
      ->check(finite_number());
  command
      ->add_option(
          "--light", options->lights,
          "ID=SCALE or ID=r,g,b: multiply what a light, or a group of them, sends; with a cache, one "
          "that was baked --per-light")
      ->take_all();
  command->add_option("--exitance", options->exitance,
                      "Keep the diffusion that is evaluated in this file, and take it from there next time");
  command->add_flag("--certified", options->certified,
                    "No pixel and channel errs by more than the tolerance; slower");
  command
      ->add_option("--single-samples", options->single_samples,
                   "Points of single scattering per camera sample (default: 2; 0: none)")
      ->check(CLI::Range(0, 1 << 16));
  command
      ->add_option("--mc-samples", options->mc_samples,
                   "Surface points per camera sample of --method montecarlo (default: 64)")
      ->check(CLI::Range(1, 1 << 16));
  command
      ->add_option("--mc-sampling", options->mc_sampling,
                   "How they are chosen: by distance (exponential, default) or by area (uniform)")
      ->check(CLI::IsMember({"uniform", "exponential"}));
  command
      ->add_option(
          "--verify", options->verify,
          "Measure the error of the hierarchical sum at this many random pixels against the exact one")
      ->check(CLI::Range(1, 1 << 24));
  command->add_option("--aov", options->aovs,
                      "none, all (default), or a list of layers, position, normal, depth, object; "
                      "beside these irradiance, irradiance_error (of the baked samples)");
  command->add_flag("--png", options->png, "Write an sRGB preview beside the OpenEXR file");
  command->add_option("--exposure", options->exposure, "Of the preview, in stops, or auto (default: 0)");
  add_bake_options(*command, options->bake);
  add_common_options(*command, options->common);
  command->callback([options, command_line] { run(*options, command_line); });
}

}  // namespace nacre::tools
