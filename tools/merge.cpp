// nacre merge: one picture from parts of it.
#include <filesystem>

#include "common.h"
#include "nacre/render/merge_images.h"
#include "picture.h"
#include "render_options.h"

namespace nacre::tools {
namespace {

struct Options {
  CommonOptions common;
  std::vector<std::string> parts;
  std::string output, exposure = kExposure;
  bool png = false;
};

void run(const Options& options, const std::string& command_line) {
  const std::optional<double> exposure = parse_exposure(options.exposure);
  if (options.exposure != kExposure && !options.png)
    throw UsageError("--exposure is that of the preview: give --png");
  check_picture_name(options.output);
  Session session(options.common, command_line);
  check_writable(options.output, options.parts);
  const std::string preview = std::filesystem::path(options.output).replace_extension(".png").string();
  const Image image = [&] {
    const StageTimer timer(session.report(), "load");
    return merge_images(options.parts);
  }();
  {
    const StageTimer timer(session.report(), "write_image");
    save_exr(image, options.output);
    if (options.png) save_png(image, preview, exposure ? *exposure : auto_exposure(image));
  }
  session.progress().say(options.png ? options.output + " and " + preview : options.output);
  session.finish();
}

}  // namespace

void add_merge_command(CLI::App& app, const std::string& command_line) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "merge", "Put together a picture that was rendered in parts (render --tile, --crop)");
  command->add_option("parts", options->parts, "OpenEXR files that share out the pixels of one picture")
      ->required();
  command->add_option("-o,--output", options->output, "OpenEXR file to write")
      ->required()
      ->check(not_empty());
  command->add_flag("--png", options->png, "Write an sRGB preview beside it");
  command->add_option("--exposure", options->exposure, "Of the preview, in stops, or auto (default: 0)");
  add_common_options(*command, options->common);
  command->callback([options, command_line] { run(*options, command_line); });
}

}  // namespace nacre::tools
