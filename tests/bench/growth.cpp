// Caches and pictures of growing size.
#include "bench/growth.h"

#include "bench/bench_scene.h"
#include "bench/frame_cases.h"
#include "nacre/cache/cache_file.h"

namespace nacre::bench {
namespace {

constexpr int kSize = 512;
constexpr double kSamples = 200e3;

GrowthRow measure(const World& world, const Cache& cache, int size, int runs) {
  reset_peak_memory();
  const RenderParams params = bench_params(*world.scene, 0, size, 1);
  std::vector<FrameTime> times;
  for (int run = 0; run < runs; ++run) times.push_back(time_first_frame(world, cache, params));
  const FrameTime time = median_time(times);
  GrowthRow row;
  row.samples = static_cast<double>(cache.sample_count());
  row.megapixels = static_cast<double>(size) * size / (1 << 20);
  row.diffusion_seconds = time.diffusion;
  row.kernel_evaluations = time.evaluations;
  row.render_peak_bytes = static_cast<double>(peak_memory_bytes());
  return row;
}

}  // namespace

void measure_growth(double most_samples, int most_pixels, int runs, Results& results) {
  const Scene scene = load_bench_scene(bench_scenes().front());
  const World world = make_frame_world(scene);
  for (const double samples : {20e3, 100e3, kSamples, 1e6, 10e6}) {
    if (samples > most_samples) break;
    fmt::print(stderr, "growth: {:.0f} samples\n", samples);
    reset_peak_memory();
    const CacheFile file(bake_samples(scene, samples, kIrradianceSamples));
    const auto bake_peak = static_cast<double>(peak_memory_bytes());
    const Stopwatch watch;
    const Cache cache = load_cache(file.path());
    const double read_seconds = watch.seconds();
    results.by_samples.push_back(measure(world, cache, kSize, runs));
    results.by_samples.back().read_seconds = read_seconds;
    results.by_samples.back().bake_peak_bytes = bake_peak;
  }
  const Cache cache = bake_samples(scene, kSamples, kIrradianceSamples);
  for (int size = kSize; size <= most_pixels; size *= 2) {
    fmt::print(stderr, "growth: {} x {} pixels\n", size, size);
    results.by_pixels.push_back(measure(world, cache, size, runs));
  }
}

}  // namespace nacre::bench
