// nacre materials: the presets.
#include "common.h"
#include "nacre/optics/medium.h"
#include "nacre/optics/profile.h"

namespace nacre::tools {
namespace {

std::string triple(const Rgb& c) { return fmt::format("{:<9.5g} {:<9.5g} {:<9.5g}", c.x, c.y, c.z); }

void run(const CommonOptions& common, const std::string& command_line) {
  Session session(common, command_line);
  fmt::print("{:<28} {:<29}   {:<29}   {:<20} {:<5} {:<20} {}\n", "name", "sigma_s' (1/mm)", "sigma_a (1/mm)",
             "g", "eta", "total reflectance", "source");
  for (const Preset& preset : presets()) {
    const auto profiles = make_profiles(make_medium(preset));
    fmt::print("{:<28} {}   {}   {:<6.3g} {:<6.3g} {:<6.3g} {:<5} {:<6.3f} {:<6.3f} {:<6.3f} {}\n",
               preset.name, triple(preset.sigma_s_prime), triple(preset.sigma_a), preset.g.x, preset.g.y,
               preset.g.z, preset.eta, profiles[0].total, profiles[1].total, profiles[2].total,
               preset.source);
  }
  session.finish();
}

}  // namespace

void add_materials_command(CLI::App& app, const std::string& command_line) {
  auto options = std::make_shared<CommonOptions>();
  CLI::App* command = app.add_subcommand("materials", "List the measured materials");
  add_common_options(*command, *options);
  command->callback([options, command_line] { run(*options, command_line); });
}

}  // namespace nacre::tools
