// The scenes that are measured.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nacre/bake/bake.h"
#include "nacre/transport/world.h"

namespace nacre::bench {

/// A scene file, its object's size and the views of it. View v has camera 2 v, and camera 2 v + 1 is the same
/// on an orbit of 10 degrees.
struct BenchScene {
  std::string name;   // for --only
  std::string title;  // in tables
  std::string file;   // in scenes/
  std::optional<double> height_mm;
  std::vector<std::string> views;  // the file's camera, then the opposite one
  ProfileKind profile = ProfileKind::kDipole;
};
std::vector<BenchScene> bench_scenes();

/// Loads it with the cameras of its views.
Scene load_bench_scene(const BenchScene& spec);
/// What frames are rendered in: without shadows on surfaces, which would take most of the time and are not
/// what is measured.
World make_frame_world(const Scene& scene);

/// Bakes in memory, with shadows; `points` as in BakeParams.
Cache bake_samples(const Scene& scene, std::optional<double> points, std::optional<int> irradiance_samples);

/// Connections to each light per sample where caches grow: enough light to sum; a default bake of 10 M
/// samples takes an hour.
inline constexpr int kIrradianceSamples = 16;

/// Makes peak_memory_bytes() start from what is resident now (Linux: proc(5), clear_refs).
void reset_peak_memory();

/// A cache as renders find it, until the end of its life.
class CacheFile {
 public:
  explicit CacheFile(const Cache& cache);
  ~CacheFile();
  CacheFile(const CacheFile&) = delete;
  CacheFile& operator=(const CacheFile&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace nacre::bench
