// The optical coefficients of a translucent material, and the presets that are measured.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>

#include "nacre/base/math.h"

namespace nacre {

enum class ProfileKind { kDipole, kBetterDipole, kNormalized };
/// In the order of the kinds, as scene files name them.
inline constexpr std::array<std::string_view, 3> kProfileNames{"dipole", "betterdipole", "normalized"};
enum class Convention { kPublished, kConserving };

/// A homogeneous scattering medium behind a dielectric boundary. Coefficients are in 1/mm.
struct Medium {
  std::string id;        // from the scene file, else ""
  std::string place;     // "file:line" where it was defined
  std::string material;  // name of the preset it comes from, or ""
  Rgb sigma_s{0, 0, 0};  // unreduced scattering coefficient
  Rgb sigma_a{0, 0, 0};
  Rgb g{0, 0, 0};               // mean cosine of Henyey-Greenstein, in (-1, 1)
  float int_ior = 1.3f;         // inside
  float ext_ior = 1.000277f;    // outside
  bool index_is_given = false;  // by the scene, for whatever preset it is filled with
  float scale = 1;              // mm per scene unit
  ProfileKind profile = ProfileKind::kDipole;
  Convention convention = Convention::kPublished;
  bool lambert = false;  // the BRDF approximation: light leaves where it entered, by the profile's total

  float eta() const { return int_ior / ext_ior; }
};

/// From diffuse exitance to radiance, the Fresnel transmittance apart: 1/pi, or 1/(pi T) for a conserving
/// medium, which loses nothing at the exit. By quadrature: not for inner loops.
float exit_factor(const Medium& medium);

/// What diffusion needs, in 1/mm. Source: Jensen et al. 2001.
struct Reduced {
  Rgb sigma_s_prime, sigma_t_prime, alpha_prime, sigma_tr;
  Rgb mean_free_path;  // l' = 1/sigma_t', mm; infinite where sigma_t' is 0
};
Reduced reduce(const Medium& medium);
/// Smallest l' of the three channels, mm: what the density of samples follows.
float smallest_mean_free_path(const Medium& medium);

/// One row of the measured tables.
struct Preset {
  std::string_view name;
  std::string_view source;        // "Jensen et al. 2001" or "Narasimhan et al. 2006"
  Rgb sigma_s_prime, sigma_a, g;  // 1/mm
  float eta;
  Rgb tabulated_total;  // diffuse reflectance as printed in the source; negative where none is
};
std::span<const Preset> presets();
/// Case, spaces and punctuation do not count ("skim milk" finds Skimmilk). nullptr if there is none.
const Preset* find_preset(std::string_view name);
/// The presets whose names are nearest to a misspelt one, for an error message: "Marble, Ketchup, ...".
std::string suggest_presets(std::string_view name);
/// A medium with the preset's coefficients (unreduced: sigma_s = sigma_s'/(1-g)) and its eta relative to air.
Medium make_medium(const Preset& preset);

}  // namespace nacre
