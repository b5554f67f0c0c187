// Options of all commands that render, and what they come to.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common.h"
#include "nacre/render/render.h"

namespace nacre::tools {

struct RenderOptions {
  CommonOptions common;
  SceneOptions scene;
  BakeOptions bake;
  std::string cache, size, crop, method = "hierarchical", aovs = "all", exposure = kExposure;
  std::vector<std::string> lights;
  int samples_per_pixel = 0;
  std::optional<double> tolerance;
  std::optional<int> single_samples, mc_samples;
  std::optional<std::string> mc_sampling;
  bool certified = false;
};

/// All but the common ones, those of scenes and of bakes.
void add_render_options(CLI::App& command, RenderOptions& options);
Method method_of(const RenderOptions& options);
/// The K-th of N.
struct Share {
  std::size_t k = 1, n = 1;
};
/// "K/N"; "" is the whole. Throws UsageError, which names `option`.
Share parse_share(const std::string& text, const std::string& option);
/// Of the camera with that id, or the first; of its picture the K-th of N bands from the top. Throws
/// UsageError for a size, crop, band or list of channels that cannot be read; what find_camera throws.
RenderParams make_render_params(const RenderOptions& options, const Scene& scene, const std::string& camera,
                                Share tile = {});
/// Stops, or none for "auto". Throws UsageError.
std::optional<double> parse_exposure(const std::string& text);
/// Throws UsageError where an option has nothing to act on.
void check_render_options(const RenderOptions& options);
/// Media in which no light is traced that scatters once, where that was asked for.
Warnings check_single_scattering(const Scene& scene, const RenderOptions& options);

}  // namespace nacre::tools
