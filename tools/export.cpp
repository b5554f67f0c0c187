// nacre export and nacre import: a cache as a point cloud, and back.
#include "common.h"
#include "nacre/cache/cache_file.h"
#include "nacre/cache/point_cloud.h"

namespace nacre::tools {
namespace {

struct Options {
  CommonOptions common;
  std::string input, output, like;
};

void run_export(const Options& options, const std::string& command_line) {
  Session session(options.common, command_line);
  check_writable(options.output, {options.input});
  const Cache cache = [&] {
    const StageTimer timer(session.report(), "read_cache");
    return load_cache(options.input);
  }();
  {
    const StageTimer timer(session.report(), "write_points");
    export_cloud(cache, options.output);
  }
  session.progress().say(fmt::format("{}: {} points", options.output, cache.sample_count()));
  session.finish();
}

void run_import(const Options& options, const std::string& command_line) {
  Session session(options.common, command_line);
  check_writable(options.output, {options.input, options.like});
  const Cache like = options.like.empty() ? Cache{} : load_cache(options.like);
  const Cache cache = [&] {
    const StageTimer timer(session.report(), "read_points");
    return import_cloud(options.input, options.like.empty() ? nullptr : &like);
  }();
  {
    const StageTimer timer(session.report(), "write_cache");
    save_cache(cache, options.output);
  }
  session.progress().say(fmt::format("{}: {} samples", options.output, cache.sample_count()));
  session.finish();
}

}  // namespace

void add_export_commands(CLI::App& app, const std::string& command_line) {
  {
    auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand("export", "Write the samples of a cache as a point cloud");
    command->add_option("cache", options->input, "Cache file")->required();
    command->add_option("points", options->output, "Point cloud to write: .ply or .csv")->required();
    add_common_options(*command, options->common);
    command->callback([options, command_line] { run_export(*options, command_line); });
  }
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("import", "Make a cache from a point cloud that was exported");
  command->add_option("points", options->input, "Point cloud: .ply")->required();
  command->add_option("-o,--output", options->output, "Cache file to write")->required()->check(not_empty());
  command->add_option("--like", options->like,
                      "Cache that the points come from, where their file has lost what they were baked from");
  add_common_options(*command, options->common);
  command->callback([options, command_line] { run_import(*options, command_line); });
}

}  // namespace nacre::tools
