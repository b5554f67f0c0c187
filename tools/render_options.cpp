// Reading the options of all commands that render.
#include "render_options.h"

#include <charconv>

namespace nacre::tools {
namespace {

// In the order of Method.
const std::vector<std::string> kMethods{"hierarchical", "exact", "montecarlo", "lambert"};
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

void choose_band(Share tile, RenderParams& params) {
  const auto height = static_cast<std::size_t>(params.height);
  if (tile.n > height)
    throw UsageError(fmt::format("--tile {}/{}: the picture has {} rows", tile.k, tile.n, height));
  params.crop_y = static_cast<int>(height * (tile.k - 1) / tile.n);
  params.crop_height = static_cast<int>(height * tile.k / tile.n) - params.crop_y;
}

}  // namespace

Method method_of(const RenderOptions& options) {
  return static_cast<Method>(std::find(kMethods.begin(), kMethods.end(), options.method) - kMethods.begin());
}

Share parse_share(const std::string& text, const std::string& option) {
  if (text.empty()) return {};
  int k = 0, n = 0;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%d/%d%c", &k, &n, &rest) != 2 || k < 1 || n < k)
    throw UsageError(option + " " + text + ": write it as K/N, K from 1 to N");
  return {static_cast<std::size_t>(k), static_cast<std::size_t>(n)};
}

RenderParams make_render_params(const RenderOptions& options, const Scene& scene, const std::string& id,
                                Share tile) {
  const std::size_t camera = id.empty() ? 0 : find_camera(scene, id, "--camera");
  RenderParams params = default_render_params(scene, camera);
  if (!options.size.empty()) {
    const auto size = parse_size(options.size, "--size");
    params.width = params.crop_width = size[0];
    params.height = params.crop_height = size[1];
  }
  if (!options.crop.empty()) parse_crop(options.crop, params);
  if (tile.n > 1) choose_band(tile, params);
  if (std::int64_t{params.crop_width} * params.crop_height > (std::int64_t{1} << 28))
    throw UsageError("the picture has more than 2^28 pixels; render it in parts with --tile or --crop");
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

void check_render_options(const RenderOptions& options) {
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
  if (options.certified && method != Method::kHierarchical)
    throw UsageError("--certified is for --method hierarchical; " + options.method + " has no tolerance");
  if (options.tolerance && method != Method::kHierarchical)
    throw UsageError("--tolerance is that of --method hierarchical; " + options.method + " has none");
  const AovSelection aovs = parse_aovs(options.aovs);
  if ((aovs.irradiance || aovs.irradiance_error) && !uses_cache(method))
    throw UsageError("--aov irradiance shows the samples of a cache, and --method " + options.method +
                     " uses none");
  if (options.single_samples.value_or(0) > 0 && method == Method::kLambert)
    throw UsageError("--single-samples: an opaque surface, as --method lambert takes it, has no inside");
}

Warnings check_single_scattering(const Scene& scene, const RenderOptions& options) {
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

void add_render_options(CLI::App& command, RenderOptions& options) {
  command.add_option("--cache", options.cache, "Cache that `nacre bake` made (default: bake in memory)");
  command.add_option("--size", options.size, "WIDTHxHEIGHT of the picture (default: the film's)");
  command.add_option("--crop", options.crop, "X,Y,WIDTHxHEIGHT: render this part of the picture only");
  command.add_option("--spp", options.samples_per_pixel, "Samples per pixel (default: the sampler's)")
      ->check(CLI::Range(1, 1 << 16));
  command
      .add_option("--method", options.method,
                  "Diffusion: hierarchical (default) or exact sum over the cache, montecarlo without one, or "
                  "lambert, its approximation as an opaque surface")
      ->check(CLI::IsMember(kMethods));
  command
      .add_option("--tolerance", options.tolerance, "Relative error of the hierarchical sum (default: 0.01)")
      ->check(finite_number())
      ->check(CLI::Range(0.0, 1.0))
      ->check(finite_number());
  command
      .add_option("--light", options.lights,
                  "ID=SCALE or ID=r,g,b: multiply what a light, or a group of them, sends; with a cache, one "
                  "that was baked --per-light")
      ->take_all();
  command.add_flag("--certified", options.certified,
                   "No pixel and channel errs by more than the tolerance; slower");
  command
      .add_option("--single-samples", options.single_samples,
                  "Points of single scattering per camera sample (default: 2; 0: none)")
      ->check(CLI::Range(0, 1 << 16));
  command
      .add_option("--mc-samples", options.mc_samples,
                  "Surface points per camera sample of --method montecarlo (default: 64)")
      ->check(CLI::Range(1, 1 << 16));
  command
      .add_option("--mc-sampling", options.mc_sampling,
                  "How they are chosen: by distance (exponential, default) or by area (uniform)")
      ->check(CLI::IsMember({"uniform", "exponential"}));
  command.add_option("--aov", options.aovs,
                     "none, all (default), or a list of layers, position, normal, depth, object; "
                     "beside these irradiance, irradiance_error (of the baked samples)");
  command.add_option("--exposure", options.exposure, "Of the preview, in stops, or auto (default: 0)");
}

}  // namespace nacre::tools
