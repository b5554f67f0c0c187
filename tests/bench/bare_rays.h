// The least that a frame costs: its primary rays and nothing else.
#pragma once

#include <vector>

#include "nacre/render/render.h"

namespace nacre::bench {

/// The first sample of every pixel of a frame, row by row, as Renderer::render takes them.
std::vector<Ray> make_primary_rays(const Scene& scene, const RenderParams& params);

struct BareRays {
  double seconds = 0;           // median, on as many threads as the renderer has
  std::vector<float> distance;  // by ray; 0 where nothing was hit
};
/// Times a plain loop of rtcIntersect1 over rays, in an Embree scene like that of RayTracer.
BareRays time_bare_rays(const Scene& scene, const std::vector<Ray>& rays, int runs);

/// Seconds of a plain loop of rtcOccluded1 over rays there, median.
double time_bare_shadow_rays(const Scene& scene, const std::vector<Ray>& rays, int runs);

/// Share of the rays whose distance differs from the channel depth.Z of a frame, in bits. The loop is a
/// yardstick only if it is 0, or next to it.
double differing_share(const BareRays& rays, const Image& frame);

}  // namespace nacre::bench
