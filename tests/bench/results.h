// What was measured, on which machine, as Markdown and as JSON.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace nacre::bench {

double median(std::vector<double> values);

/// Primary rays of one frame at 1 sample per pixel.
struct BareRow {
  std::string scene, view;
  double bare_seconds = 0, primary_seconds = 0;  // a plain loop, and what the renderer reports
  double differing = 0;                          // share of rays that the two do not agree on
};

struct Errors {
  double relative_rmse = 0, largest = 0;
};

/// One case of one scene, view and cache. The targets say what nacre means to reach.
struct CaseRow {
  std::string scene, view, density;
  std::size_t samples = 0;
  std::string name, what;  // "a", "new material, first frame"
  int width = 0, height = 0, samples_per_pixel = 1, runs = 1;
  double diffusion_seconds = 0, primary_seconds = 0;  // medians over the runs
  std::uint64_t kernel_evaluations = 0;
  std::optional<Errors> errors;
  std::optional<double> ratio_target;
  std::optional<Errors> error_targets;

  double ratio() const { return diffusion_seconds / primary_seconds; }
  /// How much faster than kReferenceRatio times the primary rays, which is what another renderer takes.
  double speed_up() const;
  /// "yes", or what is missed; "" without targets.
  std::string met() const;
};
/// Diffusion over primary rays of Mitsuba 0.6 (dipole), as measured elsewhere.
inline constexpr double kReferenceRatio = 28;

/// A frame of a growing cache or of growing size.
struct GrowthRow {
  double samples = 0, megapixels = 0;
  double read_seconds = 0;  // of the cache from its file, not part of the next
  double diffusion_seconds = 0;
  std::uint64_t kernel_evaluations = 0;
  double bake_peak_bytes = 0, render_peak_bytes = 0;  // resident, of the whole process
};

/// A bake by its stages. Shadow rays are the connections between samples and lights that face each other.
struct BakeRow {
  double samples = 0;
  double placement_seconds = 0;  // area shares included
  double irradiance_seconds = 0, octree_seconds = 0, write_seconds = 0;
  double total_seconds = 0;
  double peak_bytes = 0;  // resident, above what there was before
  double shadow_rays = 0;
  double bare_seconds = 0;  // of as many shadow rays in a plain loop
};

struct Results {
  std::vector<BareRow> bare;
  std::vector<CaseRow> cases;
  std::vector<GrowthRow> by_samples, by_pixels;
  std::vector<BakeRow> bakes;
};

std::string format_markdown(const Results& results);
std::string format_json(const Results& results);

}  // namespace nacre::bench
