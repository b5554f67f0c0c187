// nacre bake: a scene's irradiance into a cache file.
#include <malloc.h>

#include <filesystem>

#include "cached_light.h"
#include "common.h"
#include "nacre/cache/cache_file.h"
#include "nacre/cache/fingerprint.h"
#include "nacre/cache/relight.h"
#include "nacre/scene/validity.h"

namespace nacre::tools {
namespace {

struct Options {
  CommonOptions common;
  SceneOptions scene;
  BakeOptions bake;
  std::string output;
  bool per_light = false, fixed_eta = false, add_lights = false;
};

// Where an interrupted bake is kept; nowhere beside a device.
std::string journal_path(const std::string& output) {
  std::error_code ignored;
  const auto status = std::filesystem::status(output, ignored);
  return !std::filesystem::exists(status) || std::filesystem::is_regular_file(status) ? output + ".part" : "";
}

void run(const Options& options, const std::string& command_line) {
  // Arrays of samples are gone for good when they are given back, and a bake is as large as all of them: not
  // what the program keeps otherwise.
  mallopt(M_MMAP_THRESHOLD, 1 << 20);
  Session session(options.common, command_line);
  check_writable(options.output, {options.scene.path});
  std::optional<Cache> old;
  if (options.add_lights) old = load_cache(options.output);
  const Scene scene = load_scene(options.scene, session);
  check_apart(scene, {options.output});
  session.warn(check_bodies(scene));
  BakeParams params = options.bake.params(options.common);
  params.per_light = options.per_light;
  params.fixed_eta = options.fixed_eta;
  params.journal = journal_path(options.output);
  if (old) {
    params.per_light = true;
    const BakeConditions conditions = fingerprint_conditions(old->fingerprint, scene.media.size());
    params.fixed_eta = !conditions.every_eta;
    params.interreflect = conditions.interreflect;
    params.only_lights = find_new_lights(options.output, *old, scene, params.shadows);
  }
  plan_bake(scene, params);  // refuses absurd sizes before anything is built
  const World world = [&] {
    const StageTimer timer(session.report(), "build_bvh");
    return make_world(scene, params.shadows);
  }();
  Cache cache = run_bake(world, params, session);
  if (old) {
    append_lights(*old, cache, options.output);
    cache = *std::move(old);
  }
  {
    const StageTimer timer(session.report(), "write_cache");
    save_cache(cache, options.output);
    std::error_code ignored;
    std::filesystem::remove(params.journal, ignored);
  }
  session.progress().say(fmt::format("{}: {} samples", options.output, session.report().counts["points"]));
  session.finish();
}

}  // namespace

void add_bake_command(CLI::App& app, const std::string& command_line) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("bake", "Bake the irradiance on translucent surfaces into a cache file");
  add_scene_options(*command, options->scene);
  command->add_option("-o,--output", options->output, "Cache file to write")->required()->check(not_empty());
  command->add_flag("--per-light", options->per_light,
                    "Keep what each light, or group of lights, sends apart, for `nacre render --light`");
  command->add_flag(
      "--add-lights", options->add_lights,
      "Add what lights that are new in the scene send to the cache, which was baked --per-light");
  command->add_flag("--fixed-eta", options->fixed_eta,
                    "Leave out what serves other indices of refraction: 30 bytes less a sample");
  add_bake_options(*command, options->bake);
  add_common_options(*command, options->common);
  command->callback([options, command_line] { run(*options, command_line); });
}

}  // namespace nacre::tools
