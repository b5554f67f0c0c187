// From a scene and its cache to an image.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nacre/base/progress.h"
#include "nacre/base/report.h"
#include "nacre/cache/cache.h"
#include "nacre/render/image_file.h"
#include "nacre/transport/world.h"

namespace nacre {

enum class Method { kHierarchical, kExact };

/// Which channels an image has beside R G B A.
struct AovSelection {
  bool layers = true;  // diffusion, specular, surface
  bool position = true, normal = true, depth = true, object_id = true;
};

struct RenderParams {
  std::size_t camera = 0;
  int width = 0, height = 0;  // of the whole picture
  int crop_x = 0, crop_y = 0, crop_width = 0, crop_height = 0;
  int samples_per_pixel = 16;
  Method method = Method::kHierarchical;
  double tolerance = 0.01;
  std::uint64_t seed = 0;
  AovSelection aovs;
};

/// Parameters for a camera of the scene as its film and sampler have them, without a crop.
RenderParams default_render_params(const Scene& scene, std::size_t camera);

/// Renders one picture; `cache` holds a group for each medium of the scene. A pixel depends on the scene, the
/// cache, its own coordinates, the seed, samples per pixel, method and tolerance, and on nothing else: not on
/// the crop, nor on threads. Layers: `diffusion` and `specular` of translucent objects, `surface` of all
/// others, means over the pixel's samples; R G B is their sum.
Image render(const World& world, const Cache& cache, const RenderParams& params, Progress& progress,
             Report& report);

}  // namespace nacre
