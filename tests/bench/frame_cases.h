// The cases that are timed for one view of one scene and cache.
#pragma once

#include "bench/results.h"
#include "nacre/render/render.h"

namespace nacre::bench {

struct CaseSetup {
  const World& world;  // of load_bench_scene
  const Cache& cache;
  std::size_t view = 0;
  int size = 1024, certified_size = 256;
  bool certified_frame = false;  // whether to time a certified picture of the full size, too
  int runs = 3;
};

/// Parameters of all frames: square, without single scattering.
RenderParams bench_params(const Scene& scene, std::size_t camera, int size, int samples_per_pixel);

/// Diffusion and primary rays of a first frame of a material: the renderer's construction counts. `frame`, if
/// given, receives the picture.
struct FrameTime {
  double diffusion = 0, primary = 0;
  std::uint64_t evaluations = 0;
};
FrameTime time_first_frame(const World& world, const Cache& cache, const RenderParams& params,
                           Image* frame = nullptr);
/// Each time the median of its own.
FrameTime median_time(const std::vector<FrameTime>& times);

/// Rows without the names of scene, view and density.
std::vector<CaseRow> run_cases(const CaseSetup& setup);

}  // namespace nacre::bench
