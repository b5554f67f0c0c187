// Tiles of pixels, each in waves of rays so that every stage is timed as a whole.
#pragma once

#include <atomic>
#include <span>
#include <vector>

#include "nacre/base/report.h"
#include "nacre/render/camera.h"
#include "nacre/transport/path.h"
#include "render/pixels.h"
#include "render/translucency.h"

namespace nacre {

/// Seconds of all threads per stage, and counts.
struct Totals {
  explicit Totals(std::size_t media) : lost(media), taken(media) {}
  std::atomic<double> primary{0}, diffusion{0}, single{0}, surface{0};
  std::atomic<std::uint64_t> rays{0}, shading_points{0}, evaluations{0};
  std::vector<std::atomic<std::uint64_t>> lost, taken;  // samples of single scattering, by medium
};

/// Pixels that are rendered together, from the corner of the rendered rectangle.
struct Tile {
  int x, y, width, height;
};

/// What a medium of the scene is filled with in each picture: families of materials, and where in them.
struct Filling {
  std::vector<Translucency> families;
  std::vector<MaterialFamilies::Place> of_picture;  // index: which of the wanted
};

/// The boundaries of the medium that pictures differ in: the world with each index of refraction, and which
/// of them each picture has.
struct Boundaries {
  std::size_t medium;
  std::vector<World> worlds;
  std::vector<std::uint32_t> of_picture;
};

class PixelLoop {
 public:
  /// `media` are parallel to Scene::media. Pictures differ in what fills them: they share all rays, and what
  /// surfaces reflect, from where a way meets a boundary that differs those that have the same. All have to
  /// outlive it.
  PixelLoop(const Boundaries& boundaries, std::span<const Filling> media, const RenderParams& params);
  /// Adds the samples of the pixels of a tile, to a buffer for each picture.
  void render_tile(const Tile& tile, std::span<PixelBuffer> pictures, Totals& totals) const;
  /// What the first sample of a pixel sees.
  Hit first_hit(std::uint32_t pixel) const;

 private:
  // A ray on its way, what it is worth and which layer it adds to.
  struct Path {
    PathRay ray;
    Rgb throughput{1, 1, 1};
    std::uint32_t pixel = 0;   // index into the rendered rectangle
    std::uint32_t sample = 0;  // of the pixel
    Layer layer = Layer::kSurface;
    int depth = 1;                    // edges that count towards the integrator's limit, this ray included
    int scattered = 0;                // of them, how many come after a diffuse or rough surface
    std::uint32_t branch = 1;         // which of the ways through mirrors and glass this one is
    std::uint32_t boundary = kEvery;  // that it has met, and whose pictures alone it belongs to
    Hit hit;
  };
  static constexpr std::uint32_t kEvery = 0xffffffffu;
  // The pictures that ways of one boundary, or of none yet, belong to.
  struct Audience {
    std::uint32_t boundary;
    std::vector<std::size_t> pictures;
  };
  const Audience& audience(std::uint32_t boundary) const {
    return audiences_[boundary == kEvery ? 0 : 1 + boundary];
  }
  const World& world_of(std::uint32_t boundary) const {
    return boundaries_.worlds[boundary == kEvery ? 0 : boundary];
  }

  // What the samples of a pixel share.
  struct PixelStart {
    Vec2 centre;
    std::uint64_t key, lens_key;
  };
  struct CameraSample {
    Ray ray;
    float weight;  // of the filter
  };
  PixelStart pixel_start(std::uint32_t pixel) const;
  CameraSample camera_sample(const PixelStart& start, std::uint32_t sample) const;
  std::array<int, 2> place(std::uint32_t pixel) const;
  std::uint64_t pixel_key(std::uint32_t pixel, std::uint64_t purpose) const;
  std::vector<Path> start_paths(const Tile& tile, std::span<PixelBuffer> pictures) const;
  void record_first_hits(std::vector<Path>& paths, std::span<PixelBuffer> pictures) const;
  void add_translucency(const std::vector<Path>& paths, const Audience& audience, int wave,
                        std::span<PixelBuffer> pictures, Totals& totals) const;
  void add(const Path& path, Layer layer, const Rgb& value, std::span<PixelBuffer> pictures) const;
  void shade(const Path& path, int wave, std::span<PixelBuffer> pictures, std::vector<Path>& next) const;
  void scatter(const Path& path, int wave, std::span<PixelBuffer> pictures, std::vector<Path>& next) const;
  void follow(const Path& from, const NextRay& ray, Layer layer, std::uint64_t key,
              std::vector<Path>& next) const;

  const Boundaries& boundaries_;
  std::vector<Audience> audiences_;  // of ways that have met no boundary, then of each
  const World& world_;               // any: for what does not depend on boundaries
  const RenderParams& params_;
  CameraRays camera_;
  FilterSampler filter_;
  int light_samples_;
  int depth_limit_, wave_limit_;
  bool counts_mirrors_;  // whether mirrored and refracted edges count towards the limit
  std::span<const Filling> media_;
};

}  // namespace nacre
