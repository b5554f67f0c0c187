// What lights send into the samples of all groups, in rounds where light goes between translucent objects.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "bake/journal.h"
#include "nacre/bake/bake.h"

namespace nacre {

/// Samples without irradiance yet, and the size of the triangle that each lies on.
struct PlacedSamples {
  SurfaceSamples samples;
  std::vector<float> extents;
  std::vector<Rgb> albedos;  // on the way in; empty where the surface is white
  double surface_area = 0;
};

/// Octrees over all groups; `storage` owns them.
std::vector<CacheGroup> build_groups(const BakePlan& plan, std::span<const double> areas,
                                     std::vector<SurfaceSamples> samples,
                                     std::vector<std::shared_ptr<const void>>& storage, Report& report);

/// All of its arguments have to outlive it.
class Illumination {
 public:
  Illumination(const BakePlan& plan, const BakeParams& params, std::span<const PlacedSamples> placed,
               Journal& journal, Progress& progress, Report& report)
      : plan_(plan),
        params_(params),
        placed_(placed),
        journal_(journal),
        progress_(progress),
        report_(report) {}

  /// By group, what the lights of a world send; `plane` is the number of their plane of light.
  std::vector<SampleLight> compute(const World& world, std::size_t plane);

 private:
  std::vector<SampleLight> compute_round(const World& world, std::size_t plane, int round,
                                         const TranslucentAnswer& answer);

  const BakePlan& plan_;
  const BakeParams& params_;
  std::span<const PlacedSamples> placed_;
  Journal& journal_;
  Progress& progress_;
  Report& report_;
};

}  // namespace nacre
