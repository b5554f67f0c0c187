#include "nacre/scene/vary.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <functional>
#include <vector>

#include "nacre/base/error.h"
#include "nacre/optics/invert_albedo.h"
#include "nacre/optics/profile.h"

namespace nacre {
namespace {

constexpr std::array<std::string_view, 8> kKeys{"material",      "scale",   "eta", "g",
                                                "sigma_s_prime", "sigma_a", "mfp", "albedo"};

Rgb parse_triple(const Setting& setting, const std::string& place) {
  std::vector<float> values;
  const char* at = setting.value.data();
  const char* const end = at + setting.value.size();
  for (;;) {
    float value = 0;
    const auto parsed = std::from_chars(at, end, value);
    if (parsed.ec != std::errc() || !std::isfinite(value)) break;
    values.push_back(value);
    at = parsed.ptr;
    if (at == end || *at != ',') break;
    ++at;
  }
  if (at != end || (values.size() != 1 && values.size() != 3))
    fail(ErrorCode::kValue, place, "{}={}: give a number or r,g,b", setting.key, setting.value);
  return values.size() == 1 ? Rgb(values[0]) : Rgb(values[0], values[1], values[2]);
}

float parse_number(const Setting& setting, const std::string& place) {
  const Rgb value = parse_triple(setting, place);
  if (value.x != value.y || value.x != value.z)
    fail(ErrorCode::kValue, place, "{}={}: give one number", setting.key, setting.value);
  return value.x;
}

}  // namespace

int setting_order(const std::string& key) {
  return static_cast<int>(std::ranges::find(kKeys, key) - kKeys.begin());
}

bool is_medium_key(const std::string& key) { return setting_order(key) < static_cast<int>(kKeys.size()); }

void check_settings(std::span<const Setting> settings, const std::string& place) {
  for (const Setting& one : settings)
    for (const Setting& both : settings)
      if (!one.relative && (one.key == "sigma_a" || one.key == "sigma_s_prime") &&
          (both.key == "mfp" || both.key == "albedo"))
        fail(ErrorCode::kValue, place,
             "{0} sets sigma_a and sigma_s_prime, so {1}={2} would not hold; leave out one, or write "
             "{1}*=FACTOR",
             both.key, one.key, one.value);
}

void apply_setting(Medium& medium, const Setting& setting, const std::string& place) {
  const std::string& key = setting.key;
  const auto value = [&](const Rgb& old) {
    const Rgb given = parse_triple(setting, place);
    return setting.relative ? old * given : given;
  };
  const auto check = [&](const Rgb& v, float least, float most) {
    for (int k = 0; k < 3; ++k)
      if (!(v[k] >= least && v[k] <= most))
        fail(ErrorCode::kValue, place, "{}={}: {:g} is outside of {:g} to {:g}", key, setting.value, v[k],
             least, most);
    return v;
  };
  constexpr float kMost = 1e6f, kLeast = 1e-6f, kMostCosine = 0.999f;
  const Reduced reduced = reduce(medium);
  const auto set_scattering = [&](const Rgb& sigma_s_prime) {
    for (int k = 0; k < 3; ++k) medium.sigma_s[k] = sigma_s_prime[k] / (1 - medium.g[k]);
  };
  if (key == "material") {
    const Preset* const preset = find_preset(setting.value);
    if (!preset)
      fail(ErrorCode::kValue, place, "there is no material '{}'; did you mean {}?", setting.value,
           suggest_presets(setting.value));
    const Medium of_preset = make_medium(*preset);
    medium.material = of_preset.material;
    medium.sigma_s = of_preset.sigma_s;
    medium.sigma_a = of_preset.sigma_a;
    medium.g = of_preset.g;
    if (!medium.index_is_given) {
      medium.int_ior = of_preset.int_ior;
      medium.ext_ior = of_preset.ext_ior;
    }
  } else if (key == "scale") {
    const float given = parse_number(setting, place);
    medium.scale = check(Rgb(setting.relative ? medium.scale * given : given), kLeast, kMost).x;
  } else if (key == "eta") {
    const float given = parse_number(setting, place);
    medium.int_ior = medium.ext_ior * check(Rgb(setting.relative ? medium.eta() * given : given), 1, 2).x;
  } else if (key == "g") {
    medium.g = check(value(medium.g), -kMostCosine, kMostCosine);
    set_scattering(reduced.sigma_s_prime);
  } else if (key == "sigma_s_prime") {
    set_scattering(check(value(reduced.sigma_s_prime), 0, kMost));
  } else if (key == "sigma_a") {
    medium.sigma_a = check(value(medium.sigma_a), 0, kMost);
  } else if (key == "mfp") {
    const Rgb length = check(value(reduced.mean_free_path), kLeast, kMost);
    Rgb scattering;
    for (int k = 0; k < 3; ++k) {
      scattering[k] = reduced.alpha_prime[k] / length[k];
      medium.sigma_a[k] = (1 - reduced.alpha_prime[k]) / length[k];
    }
    set_scattering(scattering);
  } else if (key == "albedo") {
    const double eta = double{medium.eta()};
    Rgb old;
    const auto profiles = make_profiles(medium);
    for (int k = 0; k < 3; ++k) old[k] = static_cast<float>(profiles[static_cast<std::size_t>(k)].total);
    const Rgb total = check(value(old), 0, static_cast<float>(largest_albedo(medium.profile, eta)));
    Rgb scattering;
    for (int k = 0; k < 3; ++k) {
      const auto [sigma_s_prime, sigma_a] =
          invert_albedo(medium.profile, double{total[k]}, double{reduced.mean_free_path[k]}, eta);
      scattering[k] = static_cast<float>(sigma_s_prime);
      medium.sigma_a[k] = static_cast<float>(sigma_a);
    }
    set_scattering(scattering);
  } else {
    fail(ErrorCode::kValue, place, "'{}' is not of a medium", key);
  }
}

}  // namespace nacre
