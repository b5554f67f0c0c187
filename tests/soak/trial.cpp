#include "soak/trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "nacre/bake/bake.h"
#include "nacre/base/file.h"
#include "nacre/base/parallel.h"
#include "nacre/cache/cache_file.h"
#include "nacre/render/render.h"
#include "nacre/scene/scene_file.h"
#include "soak/dice.h"
#include "soak/random_scene.h"

namespace nacre::soak {
namespace {

// Pictures are small: few points make the RMSE of a frame uncertain.
constexpr int kVerifiedPixels = 600, kMoreVerifiedPixels = 6000;
constexpr double kMostSamples = 20e3;

// What a scene that is sound cannot make fail: an error there is a violation.
template <class Action>
auto promised(const char* what, const Action& action) {
  try {
    return action();
  } catch (const Error& error) {
    throw std::runtime_error(fmt::format("{}: {}", what, error.what()));
  }
}

// Adds what `nacre bake` would be given to trial.options.
BakeParams choose_bake(Dice& dice, const Scene& scene, Trial& trial) {
  BakeParams params;
  params.irradiance_samples = dice.one_of({1, 2, 4, 16});
  if (dice.chance(0.3)) params.bounces = dice.integer(0, 2);
  params.per_light = dice.chance(0.3);
  params.fixed_eta = dice.chance(0.3);
  params.interreflect = dice.chance(0.1);
  params.shadows = !dice.chance(0.1);
  params.seed = dice.bits();
  if (dice.chance(0.4))
    params.points = dice.log_uniform(200, kMostSamples);
  else if (plan_bake(scene, params).points > kMostSamples)
    params.points = kMostSamples;
  trial.options =
      fmt::format("bake --irradiance-samples {} --seed {}{}{}{}{}", *params.irradiance_samples, params.seed,
                  params.per_light ? " --per-light" : "", params.fixed_eta ? " --fixed-eta" : "",
                  params.interreflect ? " --interreflect" : "", params.shadows ? "" : " --no-shadows");
  if (params.bounces) trial.options += fmt::format(" --bounces {}", *params.bounces);
  if (params.points) trial.options += fmt::format(" --points {}", *params.points);
  return params;
}

RenderParams choose_render(Dice& dice, const Scene& scene, Trial& trial) {
  const auto camera = static_cast<std::size_t>(dice.integer(0, static_cast<int>(scene.cameras.size()) - 1));
  RenderParams params = default_render_params(scene, camera);
  trial.certified = params.certified = dice.chance(0.35);
  // Tables alone may take up to 0.0074 of what can be certified.
  trial.tolerance = params.tolerance = dice.log_uniform(params.certified ? 0.0075 : 0.003, 0.1);
  params.single_samples = dice.integer(0, 2);
  params.seed = dice.bits();
  params.aovs.irradiance = params.aovs.irradiance_error = dice.chance(0.3);
  if (!params.certified && dice.chance(0.1)) {
    params.method = dice.one_of({Method::kLambert, Method::kMonteCarlo});
    params.mc_samples = 4;
  }
  trial.options += fmt::format(
      "; render --camera '{}' --seed {} --single-samples {} {}", scene.cameras[camera].id, params.seed,
      params.single_samples,
      params.method == Method::kLambert ? "--method lambert"
      : params.method == Method::kMonteCarlo
          ? "--method montecarlo --mc-samples 4"
          : fmt::format("--tolerance {}{}", params.tolerance, params.certified ? " --certified" : ""));
  return params;
}

std::string check_pixels(const Image& image) {
  for (const Channel& channel : image.channels) {
    const bool radiance = channel.name.find_first_of("RGB") == channel.name.size() - 1;
    for (std::size_t i = 0; i < channel.values.size(); ++i) {
      const float value = channel.values[i];
      if (!std::isfinite(value) || (radiance && value < 0))
        return fmt::format("pixel {} of channel {} is {}", i, channel.name, value);
    }
  }
  return "";
}

std::string compare(const Image& a, const Image& b, const char* what) {
  for (const Channel& channel : a.channels) {
    const Channel* const other = find_channel(b, channel.name);
    if (!other || other->values.size() != channel.values.size() ||
        std::memcmp(channel.values.data(), other->values.data(), channel.values.size() * sizeof(float)) != 0)
      return fmt::format("{}: channel {} differs", what, channel.name);
  }
  return "";
}

Image crop(const Image& image, const RenderParams& part) {
  Image result = image;
  for (Channel& channel : result.channels) {
    std::vector<float> values;
    for (int y = 0; y < part.crop_height; ++y) {
      const auto row = channel.values.begin() + (part.crop_y + y) * image.width + part.crop_x;
      values.insert(values.end(), row, row + part.crop_width);
    }
    channel.values = std::move(values);
  }
  return result;
}

std::string check_sum(const Renderer& renderer, const RenderParams& params, Trial& trial) {
  Verification error = renderer.verify(params, kVerifiedPixels);
  // What is promised is the RMSE of the picture: a few points more or less near an edge must not decide.
  if (!trial.certified && error.relative_rmse > trial.tolerance)
    error = renderer.verify(params, kMoreVerifiedPixels);
  trial.points = error.points;
  trial.relative_rmse = error.relative_rmse;
  trial.largest = trial.certified ? error.largest_anywhere : error.largest;
  const double bounded = trial.certified ? error.largest_anywhere : error.relative_rmse;
  if (!(bounded <= trial.tolerance))
    return fmt::format("{} {:.4g} is above the tolerance {:.4g}, at {} points",
                       trial.certified ? "an error of" : "a relative RMSE of", bounded, trial.tolerance,
                       error.points);
  return "";
}

// What has to hold of pictures of one cache.
std::string check_pictures(Dice& dice, const World& world, const Cache& cache, const std::string& folder,
                           Trial& trial) {
  Progress progress;
  Report report;
  Warnings warnings;
  const RenderParams params = choose_render(dice, *world.scene, trial);
  const Renderer renderer(world, cache, params, report);
  const auto picture = [&](const RenderParams& p) {
    return promised("rendering", [&] { return render(world, cache, p, progress, report, warnings); });
  };
  const Image image =
      promised("rendering", [&] { return renderer.render(params, progress, report, warnings); });
  std::string violation = check_pixels(image);
  if (violation.empty() && uses_cache(params.method)) violation = check_sum(renderer, params, trial);
  if (!violation.empty()) return violation;
  const std::string file = folder + "/picture.exr";
  promised("saving the picture", [&] { save_exr(image, file); });
  violation = compare(image, promised("reading the picture", [&] { return load_exr(file); }), "read again");
  if (violation.empty() && dice.chance(0.2)) {
    const ThreadLimit one(1);
    violation = compare(image, picture(params), "on one thread");
  }
  if (violation.empty() && dice.chance(0.2)) {
    RenderParams part = params;
    part.crop_width = params.crop_width / 2;
    part.crop_height = params.crop_height / 2;
    part.crop_x = params.crop_x + params.crop_width / 4;
    part.crop_y = params.crop_y + params.crop_height / 3;
    violation = compare(crop(image, part), picture(part), "a crop");
  }
  return violation;
}

void run(std::uint64_t seed, const std::string& folder, Trial& trial) {
  const std::string path = write_random_scene(seed, folder);
  Dice dice(mix_bits(seed + 1));
  const Scene scene = load_scene(path);
  const BakeParams params = choose_bake(dice, scene, trial);
  const World world = make_world(scene, params.shadows);
  Progress progress;
  Report report;
  const std::string file = folder + "/cache.nacre";
  const Cache baked = bake(world, plan_bake(scene, params), params, progress, report);
  promised("saving the cache", [&] { save_cache(baked, file); });
  const Cache cache = promised("reading the cache", [&] { return load_cache(file); });
  trial.samples = cache.sample_count();
  if (dice.chance(0.1)) {
    const ThreadLimit one(1);
    const std::string again = folder + "/again.nacre";
    save_cache(bake(world, plan_bake(scene, params), params, progress, report), again);
    if (read_text_file(file) != read_text_file(again)) trial.violation = "a bake on one thread differs";
  }
  if (trial.violation.empty()) trial.violation = check_pictures(dice, world, cache, folder, trial);
}

}  // namespace

Trial run_trial(std::uint64_t seed, const std::string& folder) {
  Trial trial;
  try {
    run(seed, folder, trial);
  } catch (const Error& error) {
    trial.refusal = error.what();
    if (trial.refusal.empty() || trial.refusal.find('\n') != std::string::npos)
      trial.violation = "an error of more than a line: " + trial.refusal;
  } catch (const std::exception& error) {
    trial.violation = std::string("an exception that is no Error: ") + error.what();
  }
  return trial;
}

}  // namespace nacre::soak
