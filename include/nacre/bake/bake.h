// The bake: from a scene to a cache.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "nacre/base/progress.h"
#include "nacre/base/report.h"
#include "nacre/cache/cache.h"
#include "nacre/transport/path.h"

namespace nacre {

class Journal;

struct BakeParams {
  std::optional<double> points;      // total over all groups
  std::optional<double> spacing_mm;  // of every group; neither: 0.65 of the smallest mean free path
  std::optional<int>
      irradiance_samples;      // per point and light; none: the scene's, else kDefaultIrradianceSamples
  std::optional<int> bounces;  // of light between opaque surfaces; none: what the scene's integrator gives
  bool shadows = true;
  bool interreflect = false;    // whether translucent objects light themselves and each other
  double irradiance_error = 0;  // relative standard error that samples are refined to; 0: none are
  bool per_light = false;       // whether lights are kept apart (light_plane_name)
  bool fixed_eta = false;       // whether the cache is for the media's own indices of refraction alone
  std::uint64_t seed = 0;
  // Where to keep what is computed, so that the same bake goes on there after it was interrupted, and after
  // how many seconds; empty: nowhere. The file stays: it is of no more use when the cache has been saved.
  std::string journal = {};
  double journal_after = 5;
  std::vector<std::string> only_lights = {};  // with per_light: the planes to compute; empty: all
};

inline constexpr double kDefaultSpacing = 0.65;  // mean free paths
inline constexpr double kFewestPoints =
    1000;  // per medium by default: enough to tell its lit side from its dark one
inline constexpr int kDefaultIrradianceSamples = 64;
inline constexpr double kMostPoints = 200e6;

/// What a bake is going to do with one group.
struct GroupPlan {
  std::string name;
  double surface_area = 0;  // scene units^2
  double points = 0;        // expected
  double spacing_mm = 0;
  int irradiance_samples = 0;
  int bounces = 0;
};
/// Whether a cache keeps what light does at other indices of refraction than the media's own: not where light
/// goes between translucent objects, whose coefficients are part of it then, nor for indices outside of
/// [kLeastEta, kMostEta].
bool keeps_every_eta(const Scene& scene, const BakeParams& params);

struct BakePlan {
  std::vector<GroupPlan> groups;  // parallel to Scene::media
  double points = 0;              // over all groups
  double bytes = 0;               // of the cache file, about
};

/// Throws Error(kLimit) above kMostPoints, with the advice to check `scale`; Error(kValue) when no shape is
/// translucent or one has no surface.
BakePlan plan_bake(const Scene& scene, const BakeParams& params);

/// Places samples on every translucent group and computes the transmitted irradiance there. With interreflect
/// it then adds, twice over, what the groups' exitance sends to all of them, directly and by bounces; what is
/// missing after that has been through translucent objects three times. Depends on scene and params alone,
/// not on threads.
Cache bake(const World& world, const BakePlan& plan, const BakeParams& params, Progress& progress,
           Report& report);

/// Points on the boundary of a medium: positions, unit outward normals and the triangle_extent of the
/// triangles they lie on.
struct ReceiverPoints {
  std::span<const Vec3> positions, normals;
  std::span<const float> extents;
  std::span<const Rgb> albedos = {};  // of the surface on the way in (surface_albedo); empty: 1
};

/// How irradiance is estimated (estimate_irradiance).
struct IrradianceParams {
  int samples = kDefaultIrradianceSamples;  // per point and light
  int bounces = 0;
  double error = 0;        // as BakeParams::irradiance_error
  bool every_eta = false;  // whether SampleLight::ratios are wanted
  std::uint64_t seed = 0;
  Journal* journal = nullptr;  // where results are looked for and kept
  std::uint64_t pass = 0;      // of the bake: records of this call have the numbers 2 pass and 2 pass + 1
};

/// Irradiance E_t transmitted at points into a medium of relative index eta, with its standard error: the
/// samples of a point are up to kIrradianceBatches estimates that are independent of each other, whose spread
/// tells it; 0 where all light comes from single directions, and empty where a single sample tells nothing.
/// With params.error, points whose standard error is above that share of their irradiance, or of a hundredth
/// of all points' mean where that is more, get twice as many samples until it is not, or they have
/// kMostRefinement times as many.
SampleLight compute_irradiance(const World& world, const ReceiverPoints& points, float eta,
                               const IrradianceParams& params, Progress& progress,
                               const TranslucentAnswer& answer = {});
inline constexpr int kIrradianceBatches = 4, kMostRefinement = 64;

}  // namespace nacre
