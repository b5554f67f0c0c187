// nacre diff: how two pictures differ.
#include "common.h"
#include "nacre/render/image_file.h"

namespace nacre::tools {
namespace {

struct Options {
  CommonOptions common;
  std::string a, b;
  std::optional<std::string> layer;
  std::optional<double> fail_above;
};

void run(const Options& options, const std::string& command_line) {
  Session session(options.common, command_line);
  const Image a = load_exr(options.a), b = load_exr(options.b);
  std::vector<std::string> layers = layer_names(b);
  if (options.layer) layers = {*options.layer == "beauty" ? "" : *options.layer};
  double worst = 0;
  for (const std::string& layer : layers) {
    const ImageDifference d = compare_images(a, b, layer);
    const std::string name = layer.empty() ? "beauty" : layer;
    worst = std::max(worst, d.relative_rmse);
    if (d.identical)
      fmt::print("{:<10} identical\n", name);
    else
      fmt::print("{:<10} relative RMSE {:.4g} %, largest error {:.4g} % at ({}, {}) in {}, PSNR {:.1f} dB\n",
                 name, 100 * d.relative_rmse, 100 * d.largest_relative, d.largest_x, d.largest_y,
                 d.largest_channel, d.psnr);
  }
  session.finish();
  if (options.fail_above && !(worst <= *options.fail_above))
    fail(ErrorCode::kMismatch, options.a, "differs from {} by a relative RMSE of {:.4g}, more than {:.4g}",
         options.b, worst, *options.fail_above);
}

}  // namespace

void add_diff_command(CLI::App& app, const std::string& command_line) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("diff", "Compare a picture with a reference, layer by layer");
  command->add_option("a", options->a, "OpenEXR file")->required();
  command->add_option("b", options->b, "OpenEXR file to compare it with")->required();
  command->add_option("--layer", options->layer, "This layer only (beauty, diffusion, ...)");
  command->add_option("--fail-above", options->fail_above,
                      "Exit with 1 when the relative RMSE of a layer is above this");
  add_common_options(*command, options->common);
  command->callback([options, command_line] { run(*options, command_line); });
}

}  // namespace nacre::tools
