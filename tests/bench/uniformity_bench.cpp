// How uniform samples are, beside random and thrown points: CSV files of radial power spectra, and of blotch
// against spacing.
#include <filesystem>

#include "bake/evenness.h"
#include "bake/surfaces.h"
#include "bench/point_sets.h"
#include "nacre/base/file.h"
#include "nacre/cache/blotch.h"

namespace nacre::bench {
namespace {

using namespace testing_support;

constexpr std::size_t kSpectrumPoints = 4000;
constexpr std::uint64_t kSeeds = 8;
constexpr float kHalfSide = 26;  // mm: 1e-3 of marble's M_o comes from beyond 20 mm
constexpr int kProbes = 800;
constexpr int kBlue = 2;

void write_file(const std::string& path, const std::string& text) {
  AtomicFile file(path);
  file.write(text.data(), text.size());
  file.commit();
}

GroupSurface sliver_plane() { return make_surface({make_sliver_plane(4000)}); }

void add(Spectrum& sum, const Spectrum& one) {
  for (std::size_t i = 0; i < Spectrum::kBins; ++i) sum.power[i] += one.power[i] / double{kSeeds};
}

std::string spectra() {
  const GroupSurface plane = make_surface({make_rectangle()}), slivers = sliver_plane(),
                     sphere = make_surface({make_sphere()});
  std::vector<Spectrum> columns(6);
  const std::vector<float> ones(2 * kSpectrumPoints, 1.0f);
  const auto equal = [&](const auto& points) {
    return std::vector<float>(ones.begin(), ones.begin() + static_cast<std::ptrdiff_t>(points.size()));
  };
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    fmt::print(stderr, "spectra: {} of {}\n", seed, kSeeds);
    const auto own = place(plane, kSpectrumPoints, seed), on_slivers = place(slivers, kSpectrumPoints, seed),
               on_sphere = place(sphere, kSpectrumPoints, seed);
    const auto random = random_points(plane, own.size(), seed),
               thrown = thrown_points(plane, own.size(), seed);
    add(columns[0], plane_spectrum(own, equal(own)));
    add(columns[1], sphere_spectrum(on_sphere, equal(on_sphere)));
    add(columns[2], plane_spectrum(on_slivers, equal(on_slivers)));
    add(columns[3], plane_spectrum(own, share(plane, own)));
    add(columns[4], plane_spectrum(thrown, equal(thrown)));
    add(columns[5], plane_spectrum(random, equal(random)));
  }
  std::string text =
      "frequency,nacre: plane,nacre: sphere,nacre: slivers,nacre: plane with area shares,thrown "
      "darts,random\n";
  for (std::size_t i = 0; i < Spectrum::kBins; ++i) {
    text += fmt::format("{:.3f}", (static_cast<double>(i) + 0.5) * Spectrum::kWidth);
    for (const Spectrum& column : columns) text += fmt::format(",{:.5g}", column.power[i]);
    text += "\n";
  }
  return text;
}

double blotch(const GroupSurface& surface, const std::vector<PlacedPoint>& points, std::vector<float> areas,
              const Medium& medium, const std::vector<Vec3>& probes) {
  SurfaceSamples samples;
  for (const PlacedPoint& point : points) {
    samples.positions.push_back(point.position);
    samples.normals.push_back(point.normal);
  }
  samples.areas = std::move(areas);
  return measure_evenness(samples, surface.areas.total(), medium, probes, kBlue).blotch;
}

// Marble's blue channel, in percent.
std::string blotches() {
  Medium medium = make_medium(*find_preset("Marble"));
  medium.scale = 1;
  const double length = static_cast<double>(reduce(medium).mean_free_path[kBlue]);
  const GroupSurface plane = make_surface({placed(make_rectangle(), kHalfSide, Vec3(0))}),
                     slivers = make_surface({placed(make_sliver_plane(4000), kHalfSide, Vec3(0))}),
                     sphere = make_surface({placed(make_sphere(), 15, Vec3(0))});
  std::vector<Vec3> middle, around;
  for (int i = 0; i < kProbes; ++i) {
    const Vec2 u = sobol_2d(static_cast<std::uint32_t>(i), 3);
    middle.emplace_back((u.x - 0.5f) * 12, (u.y - 0.5f) * 12, 0.0f);
  }
  for (const PlacedPoint& point : place(sphere, kProbes, 77)) around.push_back(point.position);
  std::string text =
      "spacing,nacre: plane,nacre: sphere,nacre: slivers,as nacre predicts,nacre's points with equal "
      "areas,thrown darts,random\n";
  for (const double spacing : {0.4, 0.5, 0.65, 0.8, 1.0, 1.25, 1.6, 2.0}) {
    fmt::print(stderr, "blotch: spacing {}\n", spacing);
    const auto target = [&](const GroupSurface& surface) {
      return 2 / std::sqrt(3.0) * surface.areas.total() / square(spacing * length);
    };
    const auto equal = [](const GroupSurface& surface, std::size_t count) {
      return std::vector<float>(count,
                                static_cast<float>(surface.areas.total() / static_cast<double>(count)));
    };
    const auto own = place(plane, target(plane)), on_slivers = place(slivers, target(slivers)),
               on_sphere = place(sphere, target(sphere));
    const auto random = random_points(plane, own.size(), 1), thrown = thrown_points(plane, own.size(), 1);
    text += fmt::format("{}", spacing);
    for (const double value :
         {blotch(plane, own, share(plane, own), medium, middle),
          blotch(sphere, on_sphere, share(sphere, on_sphere), medium, around),
          blotch(slivers, on_slivers, share(slivers, on_slivers), medium, middle), predict_blotch(spacing),
          blotch(plane, own, equal(plane, own.size()), medium, middle),
          blotch(plane, thrown, equal(plane, own.size()), medium, middle),
          blotch(plane, random, equal(plane, own.size()), medium, middle)})
      text += fmt::format(",{:.4g}", 100 * value);
    text += "\n";
  }
  return text;
}

}  // namespace
}  // namespace nacre::bench

int main(int argc, char** argv) {
  if (argc != 2 || argv[1][0] == '-') {
    fmt::print(stderr, "usage: nacre_uniformity_bench FOLDER\n\nWrites spectrum.csv and blotch.csv there.\n");
    return 2;
  }
  try {
    const std::filesystem::path folder(argv[1]);
    nacre::bench::write_file(folder / "spectrum.csv", nacre::bench::spectra());
    nacre::bench::write_file(folder / "blotch.csv", nacre::bench::blotches());
  } catch (const std::exception& error) {
    fmt::print(stderr, "nacre_uniformity_bench: {}\n", error.what());
    return 1;
  }
}
