// Choosing and scaling baked light.
#include "cached_light.h"

#include <charconv>

#include "common.h"
#include "nacre/base/math.h"
#include "nacre/cache/blotch.h"
#include "nacre/cache/cache_file.h"
#include "nacre/cache/fingerprint.h"
#include "nacre/cache/relight.h"

namespace nacre::tools {
namespace {

constexpr float kMostScale = 1e9f;

// "2" or "1,0.5,0"
std::optional<Rgb> parse_scale(const std::string& text) {
  std::vector<float> values;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (;;) {
    float value = 0;
    const auto parsed = std::from_chars(at, end, value);
    if (parsed.ec != std::errc() || !(value >= 0 && value <= kMostScale)) return std::nullopt;
    values.push_back(value);
    if (parsed.ptr == end) break;
    if (*parsed.ptr != ',') return std::nullopt;
    at = parsed.ptr + 1;
  }
  if (values.size() == 1) return Rgb(values[0], values[0], values[0]);
  if (values.size() == 3) return Rgb(values[0], values[1], values[2]);
  return std::nullopt;
}

std::string names_of_lights(const Scene& scene) {
  std::string names;
  for (std::size_t i = 0; i < scene.lights.size(); ++i) {
    names += (i > 0 ? ", '" : "'") + light_name(scene, i) + "'";
    if (!scene.lights[i].group.empty()) names += " (of '" + scene.lights[i].group + "')";
  }
  return names.empty() ? "no light" : names;
}

// The scale of each of a group's planes of light. Those that share one cannot be scaled apart.
std::vector<LightScale> scale_planes(const CacheGroup& group, const Scene& scene,
                                     const std::vector<Rgb>& light_scales, const std::string& path) {
  std::vector<LightScale> scales;
  const auto plane_of = [&](std::size_t light) {
    const std::string name = light_plane_name(scene, light);
    const bool apart = std::ranges::find(group.lights, name, &LightPlane::name) != group.lights.end();
    return apart ? name : std::string();
  };
  for (std::size_t i = 0; i < light_scales.size(); ++i) {
    const std::string plane = plane_of(i);
    const auto found = std::ranges::find(scales, plane, &LightScale::name);
    if (found == scales.end())
      scales.push_back({plane, light_scales[i]});
    else if (found->scale != light_scales[i])
      fail(ErrorCode::kMismatch, path, "--light: the cache does not keep {} apart; {}",
           plane.empty() ? "its lights" : "the lights of '" + plane + "'",
           plane.empty() ? "bake it with --per-light" : "scale them alike, or bake them without their group");
  }
  // Imported and older caches know of no lights.
  if (group.lights.empty() && !scales.empty() && scales[0].scale != Rgb(1, 1, 1))
    fail(ErrorCode::kMismatch, path, "--light: the cache does not know its lights; bake it with --per-light");
  return scales;
}

}  // namespace

std::vector<Rgb> find_light_scales(const Scene& scene, const std::vector<std::string>& arguments,
                                   const std::string& place) {
  std::vector<Rgb> scales(scene.lights.size(), Rgb(1, 1, 1));
  for (const std::string& argument : arguments) {
    const std::size_t equals = argument.rfind('=');
    const std::optional<Rgb> scale =
        equals == std::string::npos ? std::nullopt : parse_scale(argument.substr(equals + 1));
    if (!scale)
      throw UsageError(
          fmt::format("{} {}: write it as ID=SCALE or ID=r,g,b, numbers from 0 to 1e9", place, argument));
    const std::string id = argument.substr(0, equals);
    bool found = false;
    for (std::size_t i = 0; i < scales.size(); ++i)
      if (light_name(scene, i) == id || scene.lights[i].group == id) {
        scales[i] = *scale;
        found = true;
      }
    if (!found || id.empty())
      fail(ErrorCode::kValue, place, "no light has the id '{}'; there is {}", id, names_of_lights(scene));
  }
  return scales;
}

void scale_lights(Scene& scene, const std::vector<Rgb>& scales) {
  for (std::size_t i = 0; i < scales.size(); ++i)
    if (scales[i] != Rgb(1, 1, 1)) scale_light(scene.lights[i], scales[i]);
}

std::vector<LightScale> check_cache(Cache& cache, const std::string& path, const Scene& scene, bool shadows,
                                    const std::vector<Rgb>& light_scales) {
  BakeConditions conditions = fingerprint_conditions(cache.fingerprint, scene.media.size());
  conditions.shadows = shadows;
  const std::string mismatch = describe_mismatch(cache.fingerprint, make_fingerprint(scene, conditions));
  if (!mismatch.empty() || cache.groups.size() != scene.media.size())
    fail(ErrorCode::kMismatch, path, "was baked for another scene: {}; {}",
         mismatch.empty() ? "the number of translucent groups differs" : mismatch,
         mismatch.find("/coefficients ") == std::string::npos
             ? "bake it again"
             : "--interreflect is for the materials it was baked with: bake it again, or without");
  std::vector<LightScale> scales;
  for (std::size_t m = 0; m < cache.groups.size(); ++m) {
    CacheGroup& group = cache.groups[m];
    const double eta = double{scene.media[m].eta()};
    // With eta in the fingerprint it is the one that was baked.
    if (!conditions.every_eta) group.eta = eta;
    if (!serves_eta(group, eta))
      fail(ErrorCode::kMismatch, path,
           "the cache holds irradiance for {}, and the index of refraction of {} is {:.6g}; bake it again",
           group.lights.empty() ? fmt::format("an index of refraction of {:.6g} alone", group.eta)
                                : fmt::format("indices of refraction from {} to {}", kLeastEta, kMostEta),
           medium_label(scene, m), eta);
    scales = scale_planes(group, scene, light_scales, path);
  }
  return scales;
}

ScaledCache load_scaled_cache(const std::string& path, const Scene& scene, bool shadows,
                              const std::vector<Rgb>& light_scales, Report& report) {
  const StageTimer timer(report, "read_cache");
  ScaledCache scaled{load_cache(path), {}};
  scaled.scales = check_cache(scaled.cache, path, scene, shadows, light_scales);
  return scaled;
}

Cache load_matching_cache(const std::string& path, const Scene& scene, bool shadows,
                          const std::vector<Rgb>& light_scales, Report& report) {
  const ScaledCache scaled = load_scaled_cache(path, scene, shadows, light_scales, report);
  const StageTimer timer(report, "read_cache");
  std::vector<double> etas;
  for (const Medium& medium : scene.media) etas.push_back(double{medium.eta()});
  return scaled.relit(etas);
}

std::vector<std::string> find_new_lights(const std::string& path, const Cache& cache, const Scene& scene,
                                         bool shadows) {
  BakeConditions conditions = fingerprint_conditions(cache.fingerprint, scene.media.size());
  conditions.shadows = shadows;
  // What is new of lights alone may be.
  KeyValues old_part;
  for (const auto& entry : make_fingerprint(scene, conditions)) {
    const bool known = std::ranges::find(cache.fingerprint, entry.first, &KeyValues::value_type::first) !=
                       cache.fingerprint.end();
    if (known || !entry.first.starts_with("light ")) old_part.push_back(entry);
  }
  const std::string mismatch = describe_mismatch(cache.fingerprint, old_part);
  if (!mismatch.empty())
    fail(ErrorCode::kMismatch, path, "--add-lights: more than lights has changed: {}; bake it again",
         mismatch);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < scene.lights.size(); ++i) {
    const std::string prefix = "light " + light_name(scene, i) + "/", plane = light_plane_name(scene, i);
    const bool baked = std::ranges::any_of(
        cache.fingerprint, [&](const auto& entry) { return entry.first.starts_with(prefix); });
    if (baked) continue;
    for (const CacheGroup& group : cache.groups)
      if (std::ranges::find(group.lights, plane, &LightPlane::name) != group.lights.end())
        fail(ErrorCode::kMismatch, path, "--add-lights: the plane '{}' is there, without {}; bake it again",
             plane, light_name(scene, i));
    if (std::ranges::find(names, plane) == names.end()) names.push_back(plane);
  }
  if (names.empty()) fail(ErrorCode::kValue, path, "--add-lights: the cache has all lights of the scene");
  return names;
}

// Says where a material is too fine-grained for the cache, and what would serve.
Warnings check_density(const Scene& scene, const Cache& cache) {
  Warnings warnings;
  for (std::size_t m = 0; m < scene.media.size(); ++m) {
    const Medium& medium = scene.media[m];
    if (medium.lambert) continue;  // uses no samples
    const CacheGroup& group = cache.groups[m];
    const double spacing = hexagonal_spacing(group) * medium.scale;
    const double length = smallest_mean_free_path(medium);
    const double blotch = predict_blotch(spacing / length);
    if (blotch > kAcceptableBlotch)
      warnings.push_back(fmt::format(
          "{}: the samples of {} are {:.3g} mm apart, {:.2g} mean free paths: expect "
          "blotches of {}; --spacing {:.3g} would serve",
          medium.place, medium_label(scene, m), spacing, spacing / length,
          blotch > 1 ? "more than 100 %" : fmt::format("{:.1f} %", 100 * blotch), kDefaultSpacing * length));
  }
  return warnings;
}

}  // namespace nacre::tools
