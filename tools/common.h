// What all subcommands share: options, scenes from files, messages, reports.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "nacre/bake/bake.h"
#include "nacre/base/parallel.h"
#include "nacre/base/progress.h"
#include "nacre/base/report.h"
#include "nacre/scene/scene.h"

namespace nacre::tools {

/// Wrong use of the command line that CLI11 cannot see by itself: exit code 2.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct CommonOptions {
  int threads = 0;
  std::uint64_t seed = 0;
  bool quiet = false;
  std::string report_path, simd;
};

/// One run of a command: limits, progress and report for its whole life.
class Session {
 public:
  Session(const CommonOptions& options, std::string command);
  Progress& progress() { return progress_; }
  Report& report() { return report_; }
  const std::string& command() const { return command_; }
  /// Prints warnings, one line each, on standard error.
  void warn(const Warnings& warnings);
  /// Writes the report file, if one is wanted. Call when everything else is done.
  void finish();

 private:
  void check_report() const;
  CommonOptions options_;
  std::string command_;
  Stopwatch watch_;
  ThreadLimit limit_;
  Progress progress_;
  Report report_;
};

/// Accepts what is neither nan nor infinite.
CLI::Validator finite_number();
/// And above 0.
CLI::Validator positive_number();
/// Accepts whole numbers from 0 that fit 64 bits.
CLI::Validator whole_number();
/// Accepts anything but the empty word.
CLI::Validator not_empty();
void add_common_options(CLI::App& command, CommonOptions& options);

/// A scene file, or a mesh file with a material and a height.
struct SceneOptions {
  std::string path, material;
  std::optional<double> height;  // none: kDefaultHeight
  std::vector<std::string> defines;
  bool sandbox = false;
};
inline constexpr double kDefaultHeight = 50;  // mm
void add_scene_options(CLI::App& command, SceneOptions& options);
Scene load_scene(const SceneOptions& options, Session& session);

/// Density and accuracy of a bake; `add` gives the options to any command that may have to bake.
struct BakeOptions {
  std::optional<double> points, spacing;
  std::optional<int> irradiance_samples, bounces;
  std::optional<double> irradiance_error;
  bool no_shadows = false, interreflect = false;
  bool any_but_shadows() const {
    return points || spacing || irradiance_samples || bounces || interreflect || irradiance_error;
  }
  BakeParams params(const CommonOptions& common) const;
};
void add_bake_options(CLI::App& command, BakeOptions& options);
/// Plans, announces and runs a bake.
Cache run_bake(const World& world, const BakeParams& params, Session& session);

/// Fails early, before any work, if a file cannot be created there or if it would replace one of the
/// `inputs`.
void check_writable(const std::string& path, const std::vector<std::string>& inputs = {});
/// Throws UsageError if it is one of the files `inputs`.
void check_is_none_of(const std::string& path, const std::vector<std::string>& inputs);
/// Throws UsageError if one of `outputs` is a file that the scene was made of.
void check_apart(const Scene& scene, const std::vector<std::string>& outputs);
/// What --exposure is unless it is given.
inline constexpr const char* kExposure = "0";
/// The words of a subcommand as they were given, the options named in `without` left out.
std::vector<std::string> option_words(const CLI::App& command, const std::set<std::string>& without);
/// "640x480" to two positive numbers; `option` names the culprit.
std::array<int, 2> parse_size(const std::string& text, const std::string& option);
/// "12 MB" and the like.
std::string format_bytes(double bytes);

// The subcommands. Each adds itself; its callback does the work.
void add_bake_command(CLI::App& app, const std::string& command_line);
void add_render_command(CLI::App& app, const std::string& command_line);
void add_sweep_command(CLI::App& app, const std::string& command_line);
void add_info_command(CLI::App& app, const std::string& command_line);
void add_merge_command(CLI::App& app, const std::string& command_line);
void add_diff_command(CLI::App& app, const std::string& command_line);
void add_materials_command(CLI::App& app, const std::string& command_line);
void add_export_commands(CLI::App& app, const std::string& command_line);

}  // namespace nacre::tools
