// Times of the inner loops: kernel, vectorised sums, traversal, octree.
#include <benchmark/benchmark.h>

#include <limits>

#include "cache/sample_sets.h"
#include "cache/sum_lanes.h"
#include "nacre/base/simd.h"
#include "nacre/cache/exitance.h"

namespace nacre::bench {
namespace {

using namespace testing_support;

constexpr std::size_t kDistances = 4096, kSources = 4096, kPoints = 20000;

// A unit sphere of 50 mm radius.
Medium marble() { return make_material("Marble", ProfileKind::kDipole, 50); }
Medium normalized_marble() { return make_material("Marble", ProfileKind::kNormalized, 50); }

// Whose items are as many as asked for, about: make_sphere has 2 n^2.
SurfaceSamples make_sphere_of(std::int64_t count) {
  return make_sphere(static_cast<int>(std::lround(std::sqrt(static_cast<double>(count) / 2))), side_light);
}

// Seconds for each of `count` things done so far; the console shows them as "12n".
void count_each(benchmark::State& state, const char* name, double count) {
  state.counters[name] = benchmark::Counter(count, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

// Squared distances from a tenth of the profile's width to where it ends, by their logarithms.
std::vector<float> make_distances() {
  std::vector<float> distances(kDistances);
  Rng rng(5);
  for (float& r2 : distances) r2 = std::exp(-14 + 14 * rng.next_float());
  return distances;
}

void eval_kernel(benchmark::State& state, const Medium& medium) {
  const Kernel kernel(resolved_profiles(medium, 0.01));
  const std::vector<float> distances = make_distances();
  for (auto _ : state) {
    Float4 sum{};
    for (const float r2 : distances) sum = sum + kernel.eval(r2);
    benchmark::DoNotOptimize(sum);
  }
  count_each(state, "per_evaluation", static_cast<double>(state.iterations()) * kDistances);
}

// Chooses vector instructions for the length of a benchmark.
class ChosenTarget {
 public:
  explicit ChosenTarget(const std::string& name) { choose_simd_target(name); }
  ~ChosenTarget() { choose_simd_target(simd_targets().front()); }
  ChosenTarget(const ChosenTarget&) = delete;
  ChosenTarget& operator=(const ChosenTarget&) = delete;
};

void add_sources(benchmark::State& state, const std::string& target, const Medium& medium) {
  const ChosenTarget chosen(target);
  const Kernel kernel(resolved_profiles(medium, 0.01));
  std::vector<SumSource> sources(kSources);
  Rng rng(6);
  for (SumSource& source : sources)
    source = SumSource{rng.next_float(), rng.next_float(), rng.next_float(), 1e-6f,
                       Float4{1e-6f, 2e-6f, 3e-6f, 0}};
  SourceList list;
  for (const SumSource& source : sources) list.add(source);
  list.pad();
  const Vec3 x(0.4f, 0.5f, 0.6f);
  for (auto _ : state) {
    std::array<double, 3> total{};
    lanes::add_sources(kernel.tables(), list, x, total);
    benchmark::DoNotOptimize(total);
  }
  count_each(state, "per_evaluation", static_cast<double>(state.iterations()) * kSources);
}

// Exitance at points of a patch of the sphere as dense as pixels on it are, on one thread.
void eval_exitance(benchmark::State& state, double tolerance, Promise promise) {
  const OwnedGroup owned = make_group(make_sphere_of(state.range(0)));
  const Exitance exitance(owned.group, marble(), tolerance, promise);
  const std::size_t count = tolerance == 0 ? kPoints / 100 : kPoints;
  std::vector<Vec3> points;
  Rng rng(7);
  while (points.size() < count) {
    const Vec2 u = rng.next_2d() * 0.6f - Vec2(0.3f, 0.3f);
    points.push_back({u.x, u.y, std::sqrt(1 - u.length2())});
  }
  std::vector<Rgb> values(points.size());
  std::uint64_t evaluations = 0;
  for (auto _ : state) {
    exitance.eval(points, values, evaluations);
    benchmark::DoNotOptimize(values.data());
  }
  count_each(state, "per_point", static_cast<double>(state.iterations()) * static_cast<double>(count));
  count_each(state, "per_evaluation", static_cast<double>(evaluations));
  state.counters["evaluations_per_point"] =
      static_cast<double>(evaluations) /
      (static_cast<double>(state.iterations()) * static_cast<double>(count));
}

void build_octree(benchmark::State& state) {
  const SurfaceSamples samples = make_sphere_of(state.range(0));
  for (auto _ : state) {
    OwnedGroup owned = make_group(samples);
    benchmark::DoNotOptimize(owned.group.nodes.data());
  }
  count_each(state, "per_sample",
             static_cast<double>(state.iterations()) * static_cast<double>(samples.size()));
}

void register_benchmarks() {
  using benchmark::RegisterBenchmark;
  RegisterBenchmark("kernel/eval", [](benchmark::State& state) { eval_kernel(state, marble()); });
  for (const std::string& target : simd_targets()) {
    RegisterBenchmark(("add_sources/dipole/" + target).c_str(),
                      [target](benchmark::State& state) { add_sources(state, target, marble()); });
    RegisterBenchmark(("add_sources/normalized/" + target).c_str(),
                      [target](benchmark::State& state) { add_sources(state, target, normalized_marble()); });
  }
  const auto add_exitance = [](const char* name, double tolerance, Promise promise) {
    return RegisterBenchmark(name, [=](benchmark::State& state) { eval_exitance(state, tolerance, promise); })
        ->Unit(benchmark::kMillisecond);
  };
  add_exitance("exitance/1%", 0.01, Promise::kCalibrated)->RangeMultiplier(10)->Range(10'000, 1'000'000);
  add_exitance("exitance/1%_certified", 0.01, Promise::kCertified)
      ->RangeMultiplier(10)
      ->Range(10'000, 1'000'000);
  add_exitance("exitance/every_sample", 0, Promise::kCalibrated)->Arg(10'000)->Arg(100'000);
  RegisterBenchmark("build_group", build_octree)
      ->RangeMultiplier(10)
      ->Range(10'000, 1'000'000)
      ->UseRealTime()
      ->Unit(benchmark::kMillisecond);
}

}  // namespace
}  // namespace nacre::bench

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  nacre::bench::register_benchmarks();
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
