// nacre materials: the presets, and coefficients for a wanted colour.
#include "common.h"
#include "nacre/optics/invert_albedo.h"
#include "nacre/optics/medium.h"
#include "nacre/optics/profile.h"

namespace nacre::tools {
namespace {

std::string triple(const Rgb& c) { return fmt::format("{:<9.5g} {:<9.5g} {:<9.5g}", c.x, c.y, c.z); }

// bk7 in air, as scenes without indices have it.
constexpr double kDefaultEta = 1.5046 / 1.000277;

struct Options {
  CommonOptions common;
  std::vector<double> albedo, mean_free_path;
  std::string profile;
  std::optional<double> eta, g;
};

// Three numbers, or one for all channels.
Rgb channels(const std::vector<double>& numbers, const std::string& option) {
  if (numbers.size() != 1 && numbers.size() != 3)
    throw UsageError(option + ": give one number or three, r,g,b");
  Rgb result;
  for (int k = 0; k < 3; ++k)
    result[k] = static_cast<float>(numbers[numbers.size() == 1 ? 0 : static_cast<std::size_t>(k)]);
  return result;
}

void check_combination(const Options& options) {
  if (options.albedo.empty() != options.mean_free_path.empty())
    throw UsageError(std::string("--from-albedo and --mfp are needed together, ") +
                     (options.albedo.empty() ? "--from-albedo" : "--mfp") + " is missing");
  if (options.albedo.empty() && (!options.profile.empty() || options.eta || options.g))
    throw UsageError("--profile, --eta and --g go with --from-albedo");
}

// Coefficients for every profile, or for the one that was asked for.
void print_inversion(const Options& options) {
  const Rgb albedo = channels(options.albedo, "--from-albedo");
  const Rgb mean_free_path = channels(options.mean_free_path, "--mfp");
  const auto digits = [](const Rgb& c) {
    return fmt::format("{:<11.8g} {:<11.8g} {:<11.8g}", c.x, c.y, c.z);
  };
  const float eta = static_cast<float>(options.eta.value_or(kDefaultEta));
  const float g = static_cast<float>(options.g.value_or(0));
  std::string lines =
      fmt::format("{:<13} {:<35}   {:<35}   {}{}\n", "profile", "sigma_s' (1/mm)", "sigma_a (1/mm)",
                  options.g ? fmt::format("{:<35}   ", "sigma_s (1/mm)") : "", "total reflectance");
  for (std::size_t i = 0; i < kProfileNames.size(); ++i) {
    if (!options.profile.empty() && options.profile != kProfileNames[i]) continue;
    Medium medium;
    medium.profile = static_cast<ProfileKind>(i);
    medium.int_ior = eta;
    medium.ext_ior = 1;
    if (const std::string wrong = check_eta(medium.profile, double{eta}); !wrong.empty())
      throw UsageError("--eta: " + wrong);
    const double largest = largest_albedo(medium.profile, double{eta});
    for (int k = 0; k < 3; ++k) {
      if (!(albedo[k] >= 0 && albedo[k] <= largest))
        throw UsageError(fmt::format(
            "--from-albedo: no medium has the diffuse reflectance {:g}: give values from 0 to {:g}",
            albedo[k], largest));
      const auto [sigma_s_prime, sigma_a] =
          invert_albedo(medium.profile, double{albedo[k]}, double{mean_free_path[k]}, double{eta});
      medium.sigma_s[k] = static_cast<float>(sigma_s_prime);
      medium.sigma_a[k] = static_cast<float>(sigma_a);
    }
    const auto profiles = make_profiles(medium);
    lines +=
        fmt::format("{:<13} {}   {}   {}{:<8.5f} {:<8.5f} {:.5f}\n", kProfileNames[i], digits(medium.sigma_s),
                    digits(medium.sigma_a), options.g ? digits(medium.sigma_s / (1 - g)) + "   " : "",
                    profiles[0].total, profiles[1].total, profiles[2].total);
  }
  fmt::print("{}", lines);
}

void print_presets() {
  fmt::print("{:<28} {:<29}   {:<29}   {:<20} {:<5} {:<20} {}\n", "name", "sigma_s' (1/mm)", "sigma_a (1/mm)",
             "g", "eta", "total reflectance", "source");
  for (const Preset& preset : presets()) {
    const auto profiles = make_profiles(make_medium(preset));
    fmt::print("{:<28} {}   {}   {:<6.3g} {:<6.3g} {:<6.3g} {:<5} {:<6.3f} {:<6.3f} {:<6.3f} {}\n",
               preset.name, triple(preset.sigma_s_prime), triple(preset.sigma_a), preset.g.x, preset.g.y,
               preset.g.z, preset.eta, profiles[0].total, profiles[1].total, profiles[2].total,
               preset.source);
  }
}

void run(const Options& options, const std::string& command_line) {
  check_combination(options);
  Session session(options.common, command_line);
  if (options.albedo.empty())
    print_presets();
  else
    print_inversion(options);
  session.finish();
}

}  // namespace

void add_materials_command(CLI::App& app, const std::string& command_line) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("materials", "List the measured materials, or find the coefficients of a colour");
  command
      ->add_option("--from-albedo", options->albedo,
                   "R,G,B: print the coefficients whose total diffuse reflectance this is")
      ->delimiter(',')
      ->check(finite_number());
  command
      ->add_option("--mfp", options->mean_free_path, "MM or R,G,B: with the mean free path 1/sigma_t' in mm")
      ->delimiter(',')
      ->check(finite_number())
      ->check(CLI::Range(1e-6, 1e9));
  command->add_option("--profile", options->profile, "For this profile alone (default: each)")
      ->check(CLI::IsMember(std::vector<std::string>(kProfileNames.begin(), kProfileNames.end())));
  command->add_option("--eta", options->eta, "Relative index of refraction (default: bk7 in air, 1.50418)")
      ->check(finite_number())
      ->check(CLI::Range(0.1, 10.0));
  command->add_option("--g", options->g, "Mean cosine: print the unreduced sigma_s, too")
      ->check(finite_number())
      ->check(CLI::Range(-0.999, 0.999));
  add_common_options(*command, options->common);
  command->callback([options, command_line] { run(*options, command_line); });
}

}  // namespace nacre::tools
