// From a plan's settings to what is rendered.
#include "sweep_points.h"

#include <algorithm>

#include "cached_light.h"
#include "nacre/cache/fingerprint.h"
#include "shell.h"

namespace nacre::tools {

void check_sweep_options(const SweepOptions& options) {
  if (!uses_cache(method_of(options)))
    throw UsageError("--method " + options.method +
                     ": a sweep is made from a cache; give hierarchical or exact, or render one by one");
  check_render_options(options);
  if (options.vary.empty() == options.plan.empty())
    throw UsageError("give either --vary KEY=... or --plan FILE");
  if (options.zip && options.vary.size() < 2) throw UsageError("--zip walks several --vary together");
  if (options.engine.uses_slurm() && !options.shard.empty())
    throw UsageError("--shard K/N is for one machine; --engine slurm gives every job its own");
  check_engine_options(options.engine);
}

void check_sweep_keys(const SweepOptions& options, const SweepPlan& plan) {
  bool of_medium = false;
  for (const std::vector<Setting>& point : plan.points)
    for (const Setting& setting : point) {
      of_medium = of_medium || is_medium_key(setting.key);
      if (setting.key == "camera" && !options.camera.empty())
        throw UsageError("--camera " + options.camera + ": the cameras are those that the sweep varies");
      for (const std::string& light : options.lights)
        if (setting.key == "light." + light.substr(0, light.rfind('=')))
          throw UsageError("--light " + light + ": the sweep varies that one");
    }
  if (!of_medium && !options.medium.empty())
    throw UsageError("--medium " + options.medium + ": the sweep varies no medium");
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

SweepPoint make_sweep_point(const SweepOptions& options, const Scene& scene, std::size_t medium,
                            std::size_t index, const std::vector<Setting>& settings) {
  SweepPoint point{index, &settings, options.camera, options.lights, {}};
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

std::string make_sweep_key(KeyValues conditions, const SweepPoint& point, const MaterialFamilies& materials) {
  conditions.emplace_back("refined for", materials.digests[materials.places[point.index].family]);
  for (const Setting& setting : *point.settings)
    conditions.emplace_back(setting.key + (setting.relative ? "*" : ""), setting.value);
  for (const std::string& light : point.lights) conditions.emplace_back("light", light);
  conditions.emplace_back("camera", point.camera);
  return fingerprint_digest(conditions);
}

std::string describe_command(const SweepOptions& options, const SweepPoint& point) {
  std::vector<std::string> words{"nacre", "sweep"};
  words.insert(words.end(), options.words.begin(), options.words.end());
  for (const Setting& setting : *point.settings)
    words.insert(words.end(), {"--vary", setting.key + (setting.relative ? "*=" : "=") + setting.value});
  return quote_words(words);
}

}  // namespace nacre::tools
