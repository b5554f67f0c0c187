// From a scene and its cache to an image.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "nacre/base/progress.h"
#include "nacre/base/report.h"
#include "nacre/cache/cache.h"
#include "nacre/cache/material_family.h"
#include "nacre/cache/relight.h"
#include "nacre/render/image_file.h"
#include "nacre/render/monte_carlo.h"
#include "nacre/transport/world.h"

namespace nacre {

/// How diffusion is evaluated. kHierarchical and kExact sum the cache, kMonteCarlo samples the surface
/// itself, kLambert takes the material for an opaque surface of the profile's total reflectance.
enum class Method { kHierarchical, kExact, kMonteCarlo, kLambert };
/// Whether a method needs a cache.
inline bool uses_cache(Method method) { return method == Method::kHierarchical || method == Method::kExact; }

/// Which channels an image has beside R G B A.
struct AovSelection {
  bool layers = true;  // diffusion, single, specular, surface
  bool position = true, normal = true, depth = true, object_id = true;
  // Of the cache's sample that is nearest to where the first sample of a pixel sees a translucent surface:
  // E_t, and the standard error of its mean channel. Of methods that use a cache.
  bool irradiance = false, irradiance_error = false;
};

struct RenderParams {
  std::size_t camera = 0;
  int width = 0, height = 0;  // of the whole picture
  int crop_x = 0, crop_y = 0, crop_width = 0, crop_height = 0;
  int samples_per_pixel = 16;
  Method method = Method::kHierarchical;
  double tolerance = 0.01;
  bool certified = false;  // kHierarchical: tolerance bounds the error of every pixel and channel
  int single_samples = 2;  // points per camera sample, each connected to every light; 0: no single scattering
  int mc_samples = 64;     // kMonteCarlo: surface points per camera sample
  MonteCarloSampling mc_sampling = MonteCarloSampling::kExponential;
  // kMonteCarlo, kLambert: bounces of light before it enters; none: what the scene's integrator gives
  std::optional<int> bounces;
  std::uint64_t seed = 0;
  AovSelection aovs;
};

/// Parameters for a camera of the scene as its film and sampler have them, without a crop.
RenderParams default_render_params(const Scene& scene, std::size_t camera);

struct Filling;
struct Boundaries;

/// Errors of the hierarchical diffusion against the sum over every sample, by the definitions that `nacre
/// diff` uses for images: the worst channel counts, the largest is over points brighter than 1e-4 of the
/// brightest.
struct Verification {
  std::size_t points = 0;  // on translucent surfaces
  double relative_rmse = 0, largest = 0;
  double largest_anywhere = 0;  // of every channel however dark, which is what a certified tolerance bounds
};

/// Pictures that differ in what fills one medium of the scene: with each of the `wanted` materials of a plan.
/// What the plan has in common is refined for the strictest of the whole, so that its parts agree.
struct MaterialSweep {
  std::size_t medium = 0;  // of the scene
  MaterialFamilies plan;
  std::vector<std::uint32_t> wanted;  // indices into MaterialFamilies::places
};

/// Whether materials of several indices of refraction are summed up together (sort_materials). What they
/// have in common is bounded for none of them, and each has an irradiance of its own to show.
inline bool mixes_eta(const RenderParams& params) {
  return params.method == Method::kHierarchical && params.tolerance > 0 && !params.certified &&
         !params.aovs.irradiance && !params.aovs.irradiance_error;
}

/// What all pictures of a scene with one set of materials share: diffusion that was evaluated for one is
/// there for the next.
class Renderer {
 public:
  /// `cache` holds a group for each medium of the scene where the method uses one; world and cache have to
  /// outlive it. Of `params` it takes the method, its tolerance, samples and bounces; pictures have the same.
  Renderer(const World& world, const Cache& cache, const RenderParams& params, Report& report);
  /// The same for several materials in one of the scene's media, whose indices of refraction the cache has to
  /// serve. World and cache are copied, the scene has to outlive it.
  Renderer(const World& world, const ScaledCache& cache, const RenderParams& params, Report& report,
           const MaterialSweep& sweep);
  ~Renderer();

  /// Evaluates diffusion on the whole surface, so that every picture after it finds it there; nothing where
  /// it is not kept. Adds its time to "diffusion".
  void fill(Report& report) const;

  /// Takes over what --exitance has kept; a file that is not there is an empty one. Throws Error with `path`:
  /// kMismatch saying what differs, and what load_exitance throws.
  void load_exitance(const std::string& path) const;
  /// Adds what has been evaluated to that file, if that is anything new; returns whether there is anything to
  /// keep. Throws Error with `path`.
  bool save_exitance(const std::string& path) const;
  /// Number of nodes on surfaces that are known so far.
  std::size_t filled_node_count() const;

  /// Renders one picture. A pixel depends on the scene, the cache, its own coordinates and the parameters but
  /// for the crop, and on nothing else: not on threads, nor on pictures before it. Layers: `diffusion`,
  /// `single` and `specular` of translucent objects, `surface` of all others, means over the pixel's samples;
  /// R G B is their sum. Adds to `warnings` a line for each medium with samples that found no way out of it.
  Image render(const RenderParams& params, Progress& progress, Report& report, Warnings& warnings) const;
  /// A picture of each material that is wanted: all that they have in common (rays, what surfaces reflect,
  /// lists of nodes) is made once. Other than by itself a picture's diffusion differs within the tolerance.
  std::vector<Image> render_sweep(const RenderParams& params, Progress& progress, Report& report,
                                  Warnings& warnings) const;

  /// Measures the error of kHierarchical at what the first samples of `count` random pixels see that show a
  /// translucent surface; at fewer, perhaps none, where those are less than about one in a hundred.
  Verification verify(const RenderParams& params, int count) const;

 private:
  const World& world() const;

  std::unique_ptr<const Boundaries> boundaries_;
  std::vector<Cache> caches_;   // for the least eta of each family
  std::vector<Filling> media_;  // parallel to Scene::media
};

/// A single picture.
Image render(const World& world, const Cache& cache, const RenderParams& params, Progress& progress,
             Report& report, Warnings& warnings);

}  // namespace nacre
