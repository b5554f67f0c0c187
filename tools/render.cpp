// nacre render: a picture of a scene.
#include "nacre/render/render.h"

#include <filesystem>

#include "cached_light.h"
#include "film.h"
#include "nacre/base/version.h"
#include "nacre/cache/blotch.h"
#include "nacre/cache/cache_file.h"
#include "nacre/cache/exitance_file.h"
#include "nacre/cache/fingerprint.h"
#include "nacre/render/merge_images.h"
#include "shell.h"

namespace nacre::tools {
namespace {

struct Options : RenderOptions {
  std::string output, exitance, tile;
  std::vector<std::string> cameras;
  FilmOptions film;
  int verify = 0;
  bool png = false;
  std::vector<std::string> words;  // what frames of a film depend on, as it was given
};

// Options that have nothing to act on are mistakes.
void check_combination(const Options& options) {
  check_picture_name(options.output);
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
  if (!options.film.any() && !(options.film.frames.empty() && options.film.contact_sheet.empty()))
    throw UsageError("--frames and --contact-sheet are of a film: give --turntable N or --camera-path FILE");
  if (options.exposure != kExposure && !options.png && options.film.contact_sheet.empty())
    throw UsageError("--exposure is that of previews: give --png or --contact-sheet");
  if (options.film.any() && options.cameras.size() > 1)
    throw UsageError("a film is of one --camera, which --turntable or --camera-path moves");
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

// One for each camera, with its id in the names if there are several.
std::vector<Picture> plan_pictures(const Options& options) {
  std::vector<Picture> pictures;
  const std::filesystem::path output(options.output);
  const auto add = [&](const std::string& name, const std::string& label) {
    const auto beside = [&](const std::string& ending) {
      return std::filesystem::path(output).replace_filename(name + ending).string();
    };
    pictures.push_back({label, beside(output.extension().string()), beside(".png")});
  };
  if (options.cameras.size() < 2) {
    add(output.stem().string(), "");
    return pictures;
  }
  for (const std::string& camera : options.cameras) {
    std::string name = output.stem().string() + "." + camera;
    std::ranges::replace(name, '/', '_');
    add(name, camera);
    for (const Picture& other : std::span(pictures).first(pictures.size() - 1))
      if (other.path == pictures.back().path)
        throw UsageError("--camera " + camera + ": two pictures would be written to " + other.path);
  }
  return pictures;
}

// One for each frame of a film, those that are not asked for, too.
std::vector<Picture> plan_frames(const Options& options, const FilmPlan& film) {
  std::vector<Picture> frames;
  for (int frame = film.first; frame <= film.last; ++frame) {
    const std::string path = frame_path(options.output, frame);
    frames.push_back({fmt::format("frame {}", frame), path,
                      std::filesystem::path(path).replace_extension(".png").string()});
  }
  return frames;
}

// The frames that are asked for.
std::vector<Picture> choose(const FilmPlan& film, const std::vector<Picture>& frames) {
  std::vector<Picture> chosen;
  for (const int frame : film.chosen) chosen.push_back(frames[static_cast<std::size_t>(frame - film.first)]);
  return chosen;
}

// Fails if what is to be written cannot be.
void check_outputs(const Options& options, const std::vector<Picture>& pictures) {
  std::vector<std::string> inputs{options.scene.path, options.cache, options.film.camera_path};
  if (!options.exitance.empty()) {
    check_writable(options.exitance, inputs);
    inputs.push_back(options.exitance);
  }
  if (!options.film.contact_sheet.empty()) {
    check_writable(options.film.contact_sheet, inputs);
    inputs.push_back(options.film.contact_sheet);
  }
  for (const Picture& picture : pictures) {
    check_writable(picture.path, inputs);
    if (!options.png) continue;
    if (picture.preview == picture.path)
      throw UsageError("-o " + options.output + ": --png writes there; name the picture .exr");
    check_writable(picture.preview, inputs);
  }
  // Another kind of file is an error now, before a bake that would be in vain.
  if (!options.exitance.empty() && std::filesystem::exists(options.exitance) &&
      !is_exitance_file(options.exitance))
    load_exitance(options.exitance);
}

// Each by its camera; those of a film are added to the scene.
void set_params(const Options& options, const std::optional<FilmPlan>& film, Scene& scene,
                std::vector<Picture>& pictures) {
  const auto params_of = [&](std::size_t i) {
    return make_render_params(options, scene, options.cameras.empty() ? "" : options.cameras[i],
                              parse_share(options.tile, "--tile"));
  };
  if (!film) {
    for (std::size_t i = 0; i < pictures.size(); ++i) pictures[i].params = params_of(i);
    return;
  }
  const RenderParams own = params_of(0);
  const std::vector<Camera> cameras = make_film_cameras(options.film, *film, scene, own.camera);
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    pictures[i].params = own;
    pictures[i].params.camera = scene.cameras.size();
    scene.cameras.push_back(cameras[i]);
    scene.films.push_back(scene.films[own.camera]);
  }
}

// Those that are asked for and not there yet; all of them get their keys.
std::vector<Picture> find_missing(const Options& options, const FilmPlan& film, const Scene& scene,
                                  const Cache& cache, std::vector<Picture>& frames, Session& session) {
  const StageTimer timer(session.report(), "read_cache");
  const KeyValues conditions = make_conditions(options, frames[0].params, scene, cache);
  for (Picture& frame : frames) {
    KeyValues key = conditions;
    key.emplace_back("camera", describe_camera(scene.cameras[frame.params.camera]));
    for (const std::string& light : options.lights) key.emplace_back("light", light);
    frame.key = fingerprint_digest(key);
  }
  std::vector<Picture> missing = choose(film, frames);
  std::erase_if(missing, is_complete);
  session.progress().say(fmt::format("{} of {} frames to render{}", missing.size(), film.chosen.size(),
                                     film.chosen.size() > missing.size() ? ", the others are there" : ""));
  return missing;
}

// The same for a frame of a film whatever else the command renders, and wherever it writes.
std::string describe_command(const Options& options, const Picture& picture, const Session& session) {
  return options.film.any() ? quote_words(options.words) + " (" + picture.label + ")" : session.command();
}

// Of all that a part of a picture depends on but which part it is.
std::string settings_digest(const Options& options, RenderParams params, const Scene& scene,
                            const Cache& cache) {
  params.crop_x = params.crop_y = params.crop_width = params.crop_height = 0;
  KeyValues conditions = make_conditions(options, params, scene, cache);
  for (const std::string& light : options.lights) conditions.emplace_back("light", light);
  conditions.emplace_back("camera", describe_camera(scene.cameras[params.camera]));
  return fingerprint_digest(conditions);
}

void save_picture(const Image& image, const Picture& picture, const Options& options,
                  std::optional<double> exposure, Session& session) {
  const StageTimer timer(session.report(), "write_image");
  save_exr(image, picture.path);
  const bool preview = options.png && !options.film.any();
  if (preview) save_png(image, picture.preview, exposure ? *exposure : auto_exposure(image));
  session.progress().say(preview ? picture.path + " and " + picture.preview : picture.path);
}

void report_verification(const Verification& verification, const std::string& label, Session& session) {
  std::string& note = session.report().notes[label.empty() ? "verified" : "verified, " + label];
  if (verification.points == 0) {
    session.warn({"--verify: no pixel was found that shows a translucent surface" +
                  (label.empty() ? "" : ": " + label)});
    note = "0 points: no pixel was found that shows a translucent surface";
    return;
  }
  fmt::print(
      "{}diffusion at {} points: relative RMSE {:.3f} %, largest error {:.2f} % against the exact sum\n",
      label.empty() ? "" : label + ": ", verification.points, 100 * verification.relative_rmse,
      100 * verification.largest);
  note = fmt::format("{} points, relative RMSE {:.6g}, largest error {:.6g}", verification.points,
                     verification.relative_rmse, verification.largest);
}

void render_pictures(const Options& options, const std::vector<Picture>& pictures, const World& world,
                     const Cache& cache, std::optional<double> exposure, Session& session) {
  const Renderer renderer(world, cache, pictures[0].params, session.report());
  if (!options.exitance.empty()) {
    const StageTimer timer(session.report(), "read_cache");
    renderer.load_exitance(options.exitance);
  }
  // A turn sees nearly all of the surface, which is cheaper to know at once than frame by frame.
  constexpr std::size_t kFramesOfATurn = 8;
  if (options.film.turntable > 0 && pictures.size() >= kFramesOfATurn) renderer.fill(session.report());
  bool keeps_exitance = true, warned = false;
  std::size_t kept_nodes = 0;
  for (const Picture& picture : pictures) {
    Warnings warnings;
    Image image = renderer.render(picture.params, session.progress(), session.report(), warnings);
    if (!picture.label.empty())
      for (std::string& warning : warnings)
        warning += fmt::format(" ({}{})", options.film.any() ? "" : "camera ", picture.label);
    // What one frame of a film warns of, most of them would.
    if (!(warned && options.film.any())) session.warn(warnings);
    warned = warned || !warnings.empty();
    image.metadata = {{"nacre:version", kVersion},
                      {"nacre:command", describe_command(options, picture, session)},
                      {"nacre:seed", fmt::format("{}", options.common.seed)},
                      {"nacre:fingerprint", fingerprint_digest(cache.fingerprint)}};
    if (!picture.key.empty()) image.metadata[kKeyAttribute] = picture.key;
    if (image.width < image.full_width || image.height < image.full_height)
      image.metadata[kSettingsKey] = settings_digest(options, picture.params, *world.scene, cache);
    save_picture(image, picture, options, exposure, session);
    // After each picture that adds to it: a run of many may be interrupted.
    if (const std::size_t nodes = renderer.filled_node_count();
        !options.exitance.empty() && (&picture == &pictures[0] || nodes > kept_nodes)) {
      const StageTimer timer(session.report(), "write_cache");
      keeps_exitance = renderer.save_exitance(options.exitance);
      kept_nodes = nodes;
    }
    if (options.verify > 0)
      report_verification(renderer.verify(picture.params, options.verify), picture.label, session);
  }
  if (!keeps_exitance)
    session.warn({options.exitance +
                  " is not written: no medium here has exitance that is smooth between nodes (normalized "
                  "diffusion, samples further apart than a mean free path)"});
}

void run(const Options& options, const std::string& command_line) {
  const bool cached = uses_cache(method_of(options));
  const std::optional<double> exposure = parse_exposure(options.exposure);
  check_combination(options);
  Session session(options.common, command_line);
  const std::optional<FilmPlan> film =
      options.film.any() ? std::optional(plan_film(options.film)) : std::nullopt;
  std::vector<Picture> pictures = film ? plan_frames(options, *film) : plan_pictures(options);
  check_outputs(options, film ? choose(*film, pictures) : pictures);

  Scene scene = load_scene(options.scene, session);
  check_apart(scene, {options.exitance, options.film.contact_sheet});
  for (const Picture& picture : pictures)
    check_apart(scene, {picture.path, options.png ? picture.preview : ""});
  const std::vector<Rgb> light_scales = find_light_scales(scene, options.lights);
  set_params(options, film, scene, pictures);
  BakeParams bake_params = options.bake.params(options.common);
  bake_params.fixed_eta = true;  // what is not kept serves this scene alone
  session.warn(check_single_scattering(scene, options));
  if (cached && options.cache.empty() && !scene.media.empty()) plan_bake(scene, bake_params);
  std::optional<Cache> baked;
  if (!options.cache.empty() && !scene.media.empty())
    baked = load_matching_cache(options.cache, scene, bake_params.shadows, light_scales, session.report());
  std::vector<Picture> frames;
  if (film) {
    frames = std::move(pictures);
    pictures = find_missing(options, *film, scene, baked ? *baked : Cache(), frames, session);
  }
  if (!pictures.empty()) {
    scale_lights(scene, light_scales);
    const World world = [&] {
      const StageTimer timer(session.report(), "build_bvh");
      return make_world(scene, bake_params.shadows);
    }();
    const Cache cache =
        baked ? *std::move(baked) : make_cache(pictures[0].params, world, bake_params, session);
    if (cached) session.warn(check_density(scene, cache));
    render_pictures(options, pictures, world, cache, exposure, session);
  }
  if (film) show_film(options.film, *film, frames, options.png, exposure, session);
  session.finish();
}

}  // namespace

void add_render_command(CLI::App& app, const std::string& command_line) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("render", "Render a scene to an OpenEXR picture");
  add_scene_options(*command, options->scene);
  command
      ->add_option("-o,--output", options->output,
                   "OpenEXR file to write; of a film each frame has its number in place "
                   "of #### or %04d, or before the ending")
      ->required()
      ->check(not_empty());
  command
      ->add_option("--camera", options->cameras,
                   "Id of the camera (default: the first); several, one picture each, by commas or --camera "
                   "again: their ids go into the names of the pictures")
      ->check(not_empty())
      ->delimiter(',')
      ->allow_extra_args(false);
  command
      ->add_option("--tile", options->tile,
                   "K/N: render the K-th of N bands of the picture only; `nacre merge` puts them together")
      ->check(not_empty());
  command
      ->add_option("--exitance", options->exitance,
                   "Keep the diffusion that is evaluated in this file, and take it from there next time")
      ->check(not_empty());
  command
      ->add_option(
          "--verify", options->verify,
          "Measure the error of the hierarchical sum at this many random pixels against the exact one")
      ->check(CLI::Range(1, 1 << 24));
  command->add_flag("--png", options->png, "Write an sRGB preview beside the OpenEXR file");
  add_film_options(*command, options->film);
  add_render_options(*command, *options);
  add_bake_options(*command, options->bake);
  add_common_options(*command, options->common);
  command->callback([options, command, command_line] {
    options->words = option_words(*command, {"output", "frames", "contact-sheet", "png", "exposure",
                                             "exitance", "verify", "threads", "simd", "quiet", "report"});
    options->words.insert(options->words.begin(), {"nacre", "render"});
    run(*options, command_line);
  });
}

}  // namespace nacre::tools
