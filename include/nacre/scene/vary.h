// Changing one thing of a scene by name, as sweeps do.
#pragma once

#include <span>
#include <string>

#include "nacre/optics/medium.h"

namespace nacre {

/// A value for one thing: "sigma_a" and "0.1,0.2,0.3".
struct Setting {
  std::string key;
  std::string value;      // a number, r,g,b or a name
  bool relative = false;  // multiplies what is there
  bool operator==(const Setting&) const = default;
};

/// Keys of what fills a medium, in the order in which settings are applied: material, scale (mm per scene
/// unit), eta, g, sigma_s_prime, sigma_a (1/mm), mfp (l' = 1/sigma_t', mm), albedo (the
/// profile's total diffuse reflectance).
bool is_medium_key(const std::string& key);

/// Changes a medium; all others of its coefficients stay: sigma_s' under a new g, alpha' under a new mfp,
/// l' under a new albedo. A preset brings its eta, unless the scene gives one.
/// Throws Error(kValue, place) for a name that is none, a number that is out of range, and what is not
/// the medium's.
void apply_setting(Medium& medium, const Setting& setting, const std::string& place);

/// Throws Error(kValue, place) for settings of one medium that would undo each other: mfp and albedo set both
/// coefficients anew, so neither goes with a value (though with a factor) for one of them.
void check_settings(std::span<const Setting> settings, const std::string& place);

/// The rank of a key among those of media, for sorting.
int setting_order(const std::string& key);

}  // namespace nacre
