// Times of whole frames, each with the error it bought: Markdown on standard output and a JSON file.

#include "bench/bake_growth.h"
#include "bench/bare_rays.h"
#include "bench/bench_scene.h"
#include "bench/frame_cases.h"
#include "bench/growth.h"
#include "nacre/base/file.h"

namespace nacre::bench {
namespace {

constexpr const char* kUsage =
    "usage: nacre_frame_bench [--quick | --full] [--only NAME] [-o FILE]\n\n"
    "Times diffusion against primary rays and measures its error. The tables go to standard output.\n"
    "  --quick      one view of one scene at 256x256, one run: a smoke test\n"
    "  --full       a cache of 10 million samples, too\n"
    "  --only NAME  bunny50, bunny15, dragon, better, normalized, normalized_dragon, growth or bakes\n"
    "  -o FILE      where to write the figures as JSON (default: bench.json)\n";

struct Options {
  bool quick = false, full = false, help = false;
  std::string only, output = "bench.json";
};

// nullopt: wrong usage.
std::optional<Options> parse_options(const std::vector<std::string>& arguments) {
  Options options;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& argument = arguments[i];
    const bool has_value = i + 1 < arguments.size();
    if (argument == "--quick")
      options.quick = true;
    else if (argument == "--full")
      options.full = true;
    else if (argument == "-h" || argument == "--help")
      options.help = true;
    else if (argument == "--only" && has_value)
      options.only = arguments[++i];
    else if (argument == "-o" && has_value)
      options.output = arguments[++i];
    else
      return std::nullopt;
  }
  bool known = options.only.empty() || options.only == "growth" || options.only == "bakes";
  for (const BenchScene& spec : bench_scenes()) known = known || options.only == spec.name;
  if (!known || (options.quick && options.full)) return std::nullopt;
  return options;
}

// Densities of caches: total samples, or by default the scene's.
struct Density {
  std::string name;
  std::optional<double> points;
};

BareRow measure_primary_rays(const World& world, std::size_t view, int size, int runs) {
  const Scene& scene = *world.scene;
  RenderParams params = bench_params(scene, 2 * view, size, 1);
  params.method = Method::kLambert;  // the rays are the same; no diffusion between them
  params.aovs.depth = true;
  const BareRays bare = time_bare_rays(scene, make_primary_rays(scene, params), runs);
  std::vector<FrameTime> times;
  Image frame;
  for (int run = 0; run < runs; ++run) times.push_back(time_first_frame(world, {}, params, &frame));
  BareRow row;
  row.bare_seconds = bare.seconds;
  row.primary_seconds = median_time(times).primary;
  row.differing = differing_share(bare, frame);
  return row;
}

void measure_scene(const BenchScene& spec, const Options& options, Results& results) {
  const Scene scene = load_bench_scene(spec);
  const World world = make_frame_world(scene);
  const int size = options.quick ? 256 : 1024, runs = options.quick ? 1 : 3;
  const std::optional<int> irradiance_samples = options.quick ? std::optional(8) : std::nullopt;
  const std::size_t views = options.quick ? 1 : spec.views.size();
  for (std::size_t view = 0; view < views; ++view) {
    fmt::print(stderr, "{}, {}: primary rays\n", spec.title, spec.views[view]);
    BareRow row = measure_primary_rays(world, view, size, runs);
    row.scene = spec.title;
    row.view = spec.views[view];
    results.bare.push_back(row);
  }
  const std::vector<Density> densities{{"default", std::nullopt}, {"fixed", 200e3}};
  for (std::size_t d = 0; d < (options.quick ? 1 : densities.size()); ++d) {
    fmt::print(stderr, "{}: baking, {} density\n", spec.title, densities[d].name);
    const Cache cache = bake_samples(scene, densities[d].points, irradiance_samples);
    for (std::size_t view = 0; view < views; ++view) {
      fmt::print(stderr, "{}, {}: {} samples\n", spec.title, spec.views[view], cache.sample_count());
      const bool certified_frame = spec.name == "bunny50" && !options.quick;
      for (CaseRow& row : run_cases({world, cache, view, size, size / 4, certified_frame, runs})) {
        row.scene = spec.title;
        row.view = spec.views[view];
        row.density = densities[d].name;
        row.samples = cache.sample_count();
        fmt::print(stderr, "  {}, {}x{}: {:.4f} s / {:.4f} s = {:.3f} {}\n", row.name, row.width, row.height,
                   row.diffusion_seconds, row.primary_seconds, row.ratio(), row.met());
        results.cases.push_back(std::move(row));
      }
    }
  }
}

void run(const Options& options) {
  AtomicFile file(options.output);  // fails now rather than after an hour
  Results results;
  for (const BenchScene& spec : bench_scenes()) {
    if (options.only.empty() ? options.quick && !results.cases.empty() : options.only != spec.name) continue;
    measure_scene(spec, options, results);
  }
  const double most_samples = options.quick ? 100e3 : options.full ? 10e6 : 1e6;
  const int runs = options.quick ? 1 : 3;
  const auto wanted = [&](const char* name) {
    return options.only.empty() ? !options.quick : options.only == name;
  };
  if (wanted("growth")) measure_growth(most_samples, options.quick ? 1024 : 4096, runs, results);
  if (wanted("bakes")) measure_bakes(most_samples, runs, results);
  fmt::print("{}", format_markdown(results));
  const std::string json = format_json(results);
  file.write(json.data(), json.size());
  file.commit();
}

}  // namespace
}  // namespace nacre::bench

int main(int argc, char** argv) {
  const auto options = nacre::bench::parse_options({argv + 1, argv + argc});
  if (!options || options->help) {
    fmt::print(options ? stdout : stderr, "{}", nacre::bench::kUsage);
    return options ? 0 : 2;
  }
  try {
    nacre::bench::run(*options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "nacre_frame_bench: {}\n", error.what());
    return 1;
  }
}
