// Options, scenes, reports.
#include "common.h"

#include <unistd.h>

#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "nacre/base/file.h"
#include "nacre/base/parallel.h"
#include "nacre/base/simd.h"
#include "nacre/base/version.h"
#include "nacre/geometry/mesh_file.h"
#include "nacre/scene/scene_file.h"
#include "nacre/scene/validity.h"

namespace nacre::tools {

namespace {

ProgressStyle progress_style(bool quiet) {
  if (quiet) return ProgressStyle::kWarnings;
  return ::isatty(STDERR_FILENO) ? ProgressStyle::kBar : ProgressStyle::kLines;
}

Defines parse_defines(const std::vector<std::string>& texts) {
  Defines defines;
  for (const std::string& text : texts) {
    const auto equals = text.find('=');
    if (equals == std::string::npos || equals == 0)
      throw UsageError("-D " + text + ": write it as name=value");
    defines[text.substr(0, equals)] = text.substr(equals + 1);
  }
  return defines;
}

}  // namespace

Session::Session(const CommonOptions& options, std::string command)
    : options_(options),
      command_(std::move(command)),
      limit_(options.threads),
      progress_(progress_style(options.quiet)) {
  if (!options_.simd.empty() && !choose_simd_target(options_.simd))
    throw UsageError(
        fmt::format("--simd {}: this processor has {}", options_.simd, fmt::join(simd_targets(), ", ")));
  if (!options_.report_path.empty()) {
    check_writable(options_.report_path);
    check_report();
  }
}

// Replaces reports, and nothing else that may be there by now.
void Session::check_report() const {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(options_.report_path, ignored)) return;
  std::ifstream file(options_.report_path, std::ios::binary);
  const int first = file.get();
  if (file && first != '{')
    fail(ErrorCode::kValue, options_.report_path,
         "is there and is no report; name another file for --report, or remove it");
}

void Session::warn(const Warnings& warnings) {
  for (const std::string& warning : warnings)
    print_message(fmt::format("nacre: warning: {}\n", one_line(warning)));
}

void Session::finish() {
  if (options_.report_path.empty()) return;
  check_report();
  nlohmann::ordered_json json;
  json["nacre"] = kVersion;
  json["command"] = command_;
  json["threads"] = thread_count();
  json["simd"] = simd_target();
  for (const auto& [stage, seconds] : report_.seconds) json["seconds"][stage] = seconds;
  json["seconds"]["total"] = watch_.seconds();
  json["counts"] = report_.counts;
  if (!report_.notes.empty()) json["notes"] = report_.notes;
  json["peak_rss_bytes"] = peak_memory_bytes();
  const std::string text = json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  AtomicFile file(options_.report_path);
  file.write(text.data(), text.size());
  file.commit();
}

// A range lets nan through.
CLI::Validator finite_number() {
  return {[](std::string& text) {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && !std::isfinite(value))
              return text + " is no number to work with";
            return std::string();
          },
          ""};
}

CLI::Validator positive_number() {
  return {[](std::string& text) {
            double value = 0;
            if (!CLI::detail::lexical_cast(text, value) || !std::isfinite(value) || !(value > 0))
              return text + " is not a number above 0";
            return std::string();
          },
          ""};
}

CLI::Validator whole_number() {
  return {[](std::string& text) {
            std::uint64_t value = 0;
            const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
            if (error != std::errc() || end != text.data() + text.size())
              return "'" + text + "' is not a whole number from 0 to 2^64 - 1";
            return std::string();
          },
          ""};
}

CLI::Validator not_empty() {
  return {[](std::string& text) { return text.empty() ? std::string("it is empty") : std::string(); }, ""};
}

void add_common_options(CLI::App& command, CommonOptions& options) {
  command.add_option("--threads", options.threads, "Number of threads (default: all cores)")
      ->check(CLI::Range(1, 4096));
  command.add_option("--seed", options.seed, "Seed of all random numbers (default: 0)")
      ->check(whole_number());
  command.add_option("--simd", options.simd,
                     "Vector instructions to use, as the report names them, or scalar (default: the best)");
  command.add_flag("--quiet", options.quiet, "No progress; warnings and errors only");
  command.add_option("--report", options.report_path, "Write times and counts to this JSON file");
}

void add_scene_options(CLI::App& command, SceneOptions& options) {
  command.add_option("scene", options.path, "Scene file (.xml), or a mesh file (.obj .ply .stl .off)")
      ->required();
  command.add_option("-D", options.defines, "name=value: fills $name in the scene file")
      ->allow_extra_args(false);
  command.add_option("--material", options.material, "Mesh file: preset it is made of (default: Marble)");
  command.add_option("--height", options.height, "Mesh file: height of the object in mm (default: 50)")
      ->check(finite_number());
  command.add_flag("--sandbox", options.sandbox,
                   "Scene file: refuse files that it names outside of its own folder");
}

Scene load_scene(const SceneOptions& options, Session& session) {
  const StageTimer timer(session.report(), "load");
  Scene scene;
  if (is_mesh_file_name(options.path)) {
    if (!options.defines.empty())
      throw UsageError("-D fills names in a scene file; " + options.path + " is a mesh");
    const std::string material = options.material.empty() ? "Marble" : options.material;
    const Preset* preset = find_preset(material);
    if (!preset)
      fail(ErrorCode::kValue, "--material",
           "there is no material '{}'; did you mean one of {}? `nacre materials` lists them", material,
           suggest_presets(material));
    scene = make_showcase_scene(options.path, make_medium(*preset), options.height.value_or(kDefaultHeight));
  } else {
    if (!options.material.empty())
      throw UsageError("--material goes with a mesh file; a scene file names its own");
    if (options.height)
      throw UsageError("--height goes with a mesh file; shapes of a scene file have the size they have");
    scene = nacre::load_scene(options.path, parse_defines(options.defines),
                              options.sandbox ? SceneFiles::kOwnFolder : SceneFiles::kAnywhere);
  }
  session.warn(scene.warnings);
  session.warn(check_validity(scene));
  std::uint64_t triangles = 0;
  for (const Shape& shape : scene.shapes) triangles += shape.mesh.triangles.size();
  session.report().counts["triangles"] = triangles;
  return scene;
}

void add_bake_options(CLI::App& command, BakeOptions& options) {
  auto* points = command.add_option("--points", options.points, "Total number of samples, about")
                     ->check(positive_number());
  command
      .add_option("--spacing", options.spacing,
                  "Distance of samples in mm (default: 0.65 of the smallest mean free path)")
      ->check(positive_number())
      ->excludes(points);
  command
      .add_option("--irradiance-samples", options.irradiance_samples,
                  "Connections to each area light per sample (default: the scene's irrSamples, else 64)")
      ->check(CLI::Range(1, 1 << 20));
  command
      .add_option(
          "--bounces", options.bounces,
          "Bounces of light off opaque surfaces before it enters (default: as the scene's integrator)")
      ->check(CLI::Range(0, 1000));
  command
      .add_option("--irradiance-error", options.irradiance_error,
                  "Refine samples whose relative standard error is above this, with up to 64 times as many "
                  "connections")
      ->check(finite_number())
      ->check(CLI::Range(1e-4, 1.0))
      ->check(finite_number());
  command.add_flag("--interreflect", options.interreflect,
                   "Add light that translucent objects send to themselves and each other; the cache then "
                   "holds for these materials only");
  command.add_flag("--no-shadows", options.no_shadows, "Nothing blocks light");
}

BakeParams BakeOptions::params(const CommonOptions& common) const {
  BakeParams result;
  result.points = points;
  result.spacing_mm = spacing;
  result.irradiance_samples = irradiance_samples;
  result.bounces = bounces;
  result.shadows = !no_shadows;
  result.interreflect = interreflect;
  result.irradiance_error = irradiance_error.value_or(0);
  result.seed = common.seed;
  return result;
}

Cache run_bake(const World& world, const BakeParams& params, Session& session) {
  const BakePlan plan = plan_bake(*world.scene, params);
  for (const GroupPlan& group : plan.groups)
    session.progress().say(
        fmt::format("{}: about {:.0f} samples, {:.3g} mm apart", group.name, group.points, group.spacing_mm));
  session.progress().say(
      fmt::format("cache: about {:.0f} samples, {}", plan.points, format_bytes(plan.bytes)));
  return bake(world, plan, params, session.progress(), session.report());
}

// Whether two names are of one file, be it there yet or not.
bool is_same_file(const std::string& a, const std::string& b) {
  std::error_code ignored;
  const auto resolve = [&](const std::string& name) {
    return std::filesystem::weakly_canonical(std::filesystem::absolute(name, ignored), ignored);
  };
  return std::filesystem::equivalent(a, b, ignored) || resolve(a) == resolve(b);
}

void check_is_none_of(const std::string& path, const std::vector<std::string>& inputs) {
  for (const std::string& input : inputs)
    if (!input.empty() && is_same_file(path, input))
      throw UsageError(path + " is what this command reads; give another output file");
}

void check_writable(const std::string& path, const std::vector<std::string>& inputs) {
  check_is_none_of(path, inputs);
  const AtomicFile probe(path);
}

void check_apart(const Scene& scene, const std::vector<std::string>& outputs) {
  for (const std::string& output : outputs)
    if (!output.empty())
      for (const auto* const files : {&scene.sources, &scene.files}) check_is_none_of(output, *files);
}

std::vector<std::string> option_words(const CLI::App& command, const std::set<std::string>& without) {
  std::vector<std::string> words;
  for (const CLI::Option* const option : command.get_options()) {
    if (option->count() == 0 || without.contains(option->get_single_name())) continue;
    const std::string name = option->nonpositional() ? option->get_name() : "";
    if (option->get_expected_max() == 0)
      words.push_back(name);
    else
      for (const std::string& value : option->results())
        words.push_back(name.empty() ? value
                                     : fmt::format("{}{}{}", name, name.starts_with("--") ? "=" : "", value));
  }
  return words;
}

std::array<int, 2> parse_size(const std::string& text, const std::string& option) {
  std::array<int, 2> size{};
  const char* end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, size[0]);
  if (first.ec == std::errc() && first.ptr != end && *first.ptr == 'x') {
    const auto second = std::from_chars(first.ptr + 1, end, size[1]);
    if (second.ec == std::errc() && second.ptr == end && size[0] >= 1 && size[1] >= 1 && size[0] <= 65536 &&
        size[1] <= 65536)
      return size;
  }
  throw UsageError(option + " " + text + ": write it as WIDTHxHEIGHT in pixels, at most 65536 each");
}

std::string format_bytes(double bytes) {
  const char* const units[] = {"bytes", "kB", "MB", "GB", "TB"};
  int unit = 0;
  for (; bytes >= 1000 && unit < 4; ++unit) bytes /= 1000;
  return fmt::format("{:.3g} {}", bytes, units[unit]);
}

}  // namespace nacre::tools
