// <subsurface type="dipole">: coefficients, presets, indices of refraction.
#include "nacre/optics/invert_albedo.h"
#include "nacre/optics/profile.h"
#include "scene/elements.h"
#include "scene/parameters.h"

namespace nacre {
namespace {

constexpr Range kCoefficient{0, 1e6};  // 1/mm: no material has a mean free path below a nanometre
constexpr Range kCosine{-1, 1, true};
constexpr Range kMeanFreePath{1 / kCoefficient.high, 1e9};  // mm

struct Indices {
  float inside, outside;
};
Indices read_indices(Parameters& parameters) {
  return {parameters.ior("intIOR", "bk7"), parameters.ior("extIOR", "air")};
}

ProfileKind read_profile(Parameters& parameters) {
  return static_cast<ProfileKind>(parameters.choice("profile", kProfileNames));
}

// Sets sigma_s' (as sigma_s, for g = 0) and sigma_a to what diffuseReflectance and meanFreePath ask for.
void invert_reflectance(Parameters& parameters, Medium& medium) {
  const Rgb albedo = parameters.color("diffuseReflectance", {}, {});
  const Rgb mean_free_path = parameters.color("meanFreePath", {}, kMeanFreePath);
  const ProfileKind profile = read_profile(parameters);
  const Indices ior = read_indices(parameters);
  const double eta = ior.inside / ior.outside;
  const double largest = largest_albedo(profile, eta);
  for (int k = 0; k < 3; ++k) {
    if (!(albedo[k] >= 0 && albedo[k] <= largest))
      fail(ErrorCode::kValue, parameters.place("diffuseReflectance"),
           "no medium has the diffuse reflectance {:g}: give values from 0 to {:g}", albedo[k], largest);
    const auto [sigma_s_prime, sigma_a] =
        invert_albedo(profile, double{albedo[k]}, double{mean_free_path[k]}, eta);
    medium.sigma_s[k] = static_cast<float>(sigma_s_prime);
    medium.sigma_a[k] = static_cast<float>(sigma_a);
  }
}

// Coefficients come from a preset, from sigmaS and sigmaA, from sigmaT and albedo, or from diffuseReflectance
// and meanFreePath: one of the four.
Medium read_coefficients(Parameters& parameters) {
  const bool separate = parameters.has("sigmaS") || parameters.has("sigmaA");
  const bool total = parameters.has("sigmaT") || parameters.has("albedo");
  const bool preset = parameters.has("material");
  const bool inverted = parameters.has("diffuseReflectance") || parameters.has("meanFreePath");
  std::string given;
  for (const char* name :
       {"material", "sigmaS", "sigmaA", "sigmaT", "albedo", "diffuseReflectance", "meanFreePath"})
    if (parameters.has(name)) given += (given.empty() ? "" : ", ") + std::string(name);
  if (separate + total + preset + inverted > 1)
    fail(ErrorCode::kValue, parameters.plugin().place(),
         "give either material, or sigmaS and sigmaA, or sigmaT and albedo, or diffuseReflectance and "
         "meanFreePath, not more than one of them; here are {}",
         given);
  const auto need = [&](const char* a, const char* b) {
    if (!parameters.has(a) || !parameters.has(b))
      fail(ErrorCode::kValue, parameters.plugin().place(), "{} and {} are needed together, {} is missing", a,
           b, parameters.has(a) ? b : a);
  };

  Medium medium;
  const Rgb none{0, 0, 0};
  if (separate) {
    need("sigmaS", "sigmaA");
    medium.sigma_s = parameters.color("sigmaS", none, kCoefficient);
    medium.sigma_a = parameters.color("sigmaA", none, kCoefficient);
  } else if (total) {
    need("sigmaT", "albedo");
    const Rgb sigma_t = parameters.color("sigmaT", none, kCoefficient);
    const Rgb albedo = parameters.color("albedo", none, kFraction);
    medium.sigma_s = sigma_t * albedo;
    medium.sigma_a = sigma_t * (Rgb(1, 1, 1) - albedo);
  } else if (inverted) {
    need("diffuseReflectance", "meanFreePath");
    invert_reflectance(parameters, medium);
  } else {
    const std::string name = parameters.string("material", "Skin1");
    const Preset* row = find_preset(name);
    if (!row)
      fail(ErrorCode::kValue, parameters.place("material"),
           "there is no material '{}'; near it: {} (`nacre materials` lists all)", name,
           suggest_presets(name));
    medium = make_medium(*row);
  }

  const Rgb g = parameters.color("g", medium.g, kCosine);
  // Presets and inverted reflectances are sigma_s', which another g leaves as it is.
  if (!separate && !total) medium.sigma_s = medium.sigma_s * (Rgb(1, 1, 1) - medium.g) / (Rgb(1, 1, 1) - g);
  medium.g = g;
  if (max_channel(medium.sigma_s + medium.sigma_a) == 0)
    fail(ErrorCode::kValue, parameters.plugin().place(), "the medium neither scatters nor absorbs");
  return medium;
}

}  // namespace

MediumElement read_medium(const XmlElement& element, const TextureIndex& textures, Warnings& warnings) {
  if (plugin_type(element) != "dipole") fail_unknown_type(element, "dipole");
  Parameters parameters(element, warnings);
  MediumElement result;
  Medium& medium = result.medium;
  medium = read_coefficients(parameters);
  medium.id = element.get("id");
  medium.place = element.place();
  const bool has_scale = parameters.has("scale");
  medium.scale = parameters.number("scale", 1, {0, 1e9, true});
  if (!medium.material.empty() && !has_scale)
    warnings.push_back(
        fmt::format("{}: material '{}' is in 1/mm and there is no scale: one scene unit is taken as 1 mm",
                    parameters.place("material"), medium.material));
  const bool has_ior = parameters.has("intIOR") || parameters.has("extIOR");
  medium.index_is_given = has_ior;
  if (has_ior || medium.material.empty()) {
    const Indices ior = read_indices(parameters);
    medium.int_ior = ior.inside;
    medium.ext_ior = ior.outside;
  }
  medium.profile = read_profile(parameters);
  if (const std::string wrong = check_eta(medium.profile, double{medium.eta()}); !wrong.empty())
    fail(ErrorCode::kValue, element.place(), "{}", wrong);
  medium.convention = static_cast<Convention>(parameters.choice("convention", {"published", "conserving"}));
  medium.lambert = parameters.boolean("lambert", false);

  SubsurfaceSettings& settings = result.settings;
  settings.irradiance_samples = parameters.integer("irrSamples", 0, 0, 1'000'000);
  settings.indirect = parameters.boolean("irrIndirect", true);
  settings.sample_multiplier = parameters.number("sampleMultiplier", 1, {0, 1e6, true});
  const auto [albedo, texture] = parameters.color_or_texture("surfaceAlbedo", {1, 1, 1}, kFraction, textures);
  settings.surface_albedo = albedo;
  settings.albedo_texture = texture;
  settings.albedo_at_entry = parameters.number("albedoAtEntry", 0.5f, kFraction);
  if (parameters.has("quality")) {
    parameters.number("quality", 0, kPositive);
    warnings.push_back(
        fmt::format("{}: quality has no effect, --tolerance sets the accuracy", parameters.place("quality")));
  }
  parameters.finish();
  return result;
}

}  // namespace nacre
