// First frames, further frames, filled surfaces, certified frames. Each run has a Renderer of its own, so
// that nothing that one has evaluated serves another; errors are measured after all clocks have stopped.
#include "bench/frame_cases.h"

namespace nacre::bench {
namespace {

constexpr int kVerifiedPixels = 2000;
constexpr double kTolerance = 0.01;
constexpr Errors kErrorTargets{0.01, 0.05};

FrameTime time_frame(const Renderer& renderer, const RenderParams& params, Report report = {},
                     Image* frame = nullptr) {
  Progress progress;
  Warnings warnings;
  Image image = renderer.render(params, progress, report, warnings);
  if (frame) *frame = std::move(image);
  return {report.seconds["diffusion"], report.seconds["primary_rays"], report.counts["kernel_evaluations"]};
}

Errors verify(const Renderer& renderer, const RenderParams& params) {
  const Verification v = renderer.verify(params, kVerifiedPixels);
  return {v.relative_rmse, v.largest};
}

CaseRow make_row(std::string name, std::string what, const RenderParams& params,
                 const std::vector<FrameTime>& times) {
  const FrameTime time = median_time(times);
  CaseRow row;
  row.name = std::move(name);
  row.what = std::move(what);
  row.width = params.width;
  row.height = params.height;
  row.samples_per_pixel = params.samples_per_pixel;
  row.runs = static_cast<int>(times.size());
  row.diffusion_seconds = time.diffusion;
  row.primary_seconds = time.primary;
  row.kernel_evaluations = time.evaluations;
  return row;
}

CaseRow judged(CaseRow row, double ratio_target, const Errors& errors) {
  row.ratio_target = ratio_target;
  row.errors = errors;
  row.error_targets = kErrorTargets;
  return row;
}

// (a) and (c): a material is new, then the camera moves.
void add_first_and_orbit(const CaseSetup& setup, const RenderParams& first, const RenderParams& orbit,
                         std::vector<CaseRow>& rows) {
  std::vector<FrameTime> first_times, orbit_times;
  Errors first_errors, orbit_errors;
  for (int run = 0; run < setup.runs; ++run) {
    Report report;
    const Renderer renderer(setup.world, setup.cache, first, report);
    first_times.push_back(time_frame(renderer, first, report));
    orbit_times.push_back(time_frame(renderer, orbit));
    if (run + 1 < setup.runs) continue;
    first_errors = verify(renderer, first);
    orbit_errors = verify(renderer, orbit);
  }
  rows.push_back(judged(make_row("a", "new material, first frame", first, first_times), 3, first_errors));
  rows.push_back(
      judged(make_row("c", "then a camera 10 degrees further", orbit, orbit_times), 0.4, orbit_errors));
}

// (b): many samples per pixel, once.
void add_many_samples(const CaseSetup& setup, const RenderParams& params, std::vector<CaseRow>& rows) {
  Report report;
  const Renderer renderer(setup.world, setup.cache, params, report);
  const FrameTime time = time_frame(renderer, params, report);
  rows.push_back(
      judged(make_row("b", "new material, first frame", params, {time}), 0.3, verify(renderer, params)));
}

// (d): the surface is filled first, the renderer's construction included.
void add_filled(const CaseSetup& setup, const RenderParams& params, std::vector<CaseRow>& rows) {
  std::vector<FrameTime> fill_times, frame_times;
  Errors errors;
  for (int run = 0; run < setup.runs; ++run) {
    Report report;
    const Renderer renderer(setup.world, setup.cache, params, report);
    renderer.fill(report);
    frame_times.push_back(time_frame(renderer, params));
    fill_times.push_back(
        {report.seconds["diffusion"], frame_times.back().primary, report.counts["kernel_evaluations"]});
    if (run + 1 == setup.runs) errors = verify(renderer, params);
  }
  rows.push_back(make_row("d0", "filling the whole surface", params, fill_times));
  rows.push_back(judged(make_row("d", "any camera after that", params, frame_times), 0.15, errors));
}

// The largest relative error of any pixel and channel, the darkest included: a certified sum promises it.
double largest_of_all(const Image& image, const Image& exact) {
  double largest = 0;
  for (const char* const channel : {"diffusion.R", "diffusion.G", "diffusion.B"}) {
    const std::vector<float>& values = find_channel(image, channel)->values;
    const std::vector<float>& expected = find_channel(exact, channel)->values;
    for (std::size_t i = 0; i < values.size(); ++i)
      if (values[i] != expected[i])
        largest = std::max(largest, std::abs(double{values[i]} - double{expected[i]}) / double{expected[i]});
  }
  return largest;
}

// (e): a bound on the error of each pixel. `judge` compares all of them with the sum over every sample.
void add_certified(const CaseSetup& setup, RenderParams params, int runs, bool judge,
                   std::vector<CaseRow>& rows) {
  params.certified = true;
  params.aovs.layers = true;
  std::vector<FrameTime> times;
  Image frame;
  for (int run = 0; run < runs; ++run)
    times.push_back(time_first_frame(setup.world, setup.cache, params, &frame));
  CaseRow row = make_row("e", "certified, first frame", params, times);
  if (judge) {
    params.certified = false;
    params.method = Method::kExact;
    Image exact;
    time_first_frame(setup.world, setup.cache, params, &exact);
    row.errors = {compare_images(frame, exact, "diffusion").relative_rmse, largest_of_all(frame, exact)};
    row.error_targets = {kTolerance, kTolerance};
  }
  rows.push_back(std::move(row));
}

}  // namespace

RenderParams bench_params(const Scene& scene, std::size_t camera, int size, int samples_per_pixel) {
  RenderParams params = default_render_params(scene, camera);
  params.width = params.height = params.crop_width = params.crop_height = size;
  params.samples_per_pixel = samples_per_pixel;
  params.tolerance = kTolerance;
  params.single_samples = 0;
  params.aovs = {false, false, false, false, false};
  return params;
}

FrameTime time_first_frame(const World& world, const Cache& cache, const RenderParams& params, Image* frame) {
  Report report;
  const Renderer renderer(world, cache, params, report);
  return time_frame(renderer, params, report, frame);
}

FrameTime median_time(const std::vector<FrameTime>& times) {
  std::vector<double> diffusion, primary;
  for (const FrameTime& time : times) {
    diffusion.push_back(time.diffusion);
    primary.push_back(time.primary);
  }
  return {median(diffusion), median(primary), times[0].evaluations};
}

std::vector<CaseRow> run_cases(const CaseSetup& setup) {
  const Scene& scene = *setup.world.scene;
  const std::size_t first = 2 * setup.view, orbit = first + 1;
  std::vector<CaseRow> rows;
  add_first_and_orbit(setup, bench_params(scene, first, setup.size, 1),
                      bench_params(scene, orbit, setup.size, 1), rows);
  add_many_samples(setup, bench_params(scene, first, setup.size, 16), rows);
  add_filled(setup, bench_params(scene, orbit, setup.size, 1), rows);
  add_certified(setup, bench_params(scene, first, setup.certified_size, 1), setup.runs, true, rows);
  if (setup.certified_frame)
    add_certified(setup, bench_params(scene, first, setup.size, 1), 1, false, rows);  // half a minute
  return rows;
}

}  // namespace nacre::bench
