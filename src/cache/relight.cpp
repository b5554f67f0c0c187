// Sums over planes of light.
#include "nacre/cache/relight.h"

#include <algorithm>
#include <cmath>

#include "nacre/base/parallel.h"
#include "nacre/cache/octree.h"

namespace nacre {
namespace {

const Rgb kAsBaked(1, 1, 1);

Rgb scale_of(std::span<const LightScale> scales, const std::string& name) {
  const auto found = std::ranges::find(scales, name, &LightScale::name);
  return found == scales.end() ? kAsBaked : found->scale;
}

struct RelitGroup {
  std::array<std::vector<float>, 3> irradiance;
  std::vector<float> errors;
  std::vector<OctreeNode> nodes;
};

// Errors of lights are independent of each other; they are multiplied by what the irradiance was on average.
std::shared_ptr<const RelitGroup> relight_group(CacheGroup& group, double eta,
                                                std::span<const LightScale> scales) {
  const std::size_t n = group.size();
  const auto relit = std::make_shared<RelitGroup>();
  for (auto& plane : relit->irradiance) plane.assign(n, 0);
  const bool has_errors =
      std::ranges::all_of(group.lights, [&](const LightPlane& l) { return l.errors.size() == n; });
  if (has_errors) relit->errors.assign(n, 0);
  const EtaChange change(group.eta, eta);
  for (const LightPlane& light : group.lights) {
    const Rgb scale = scale_of(scales, light.name);
    const bool changes_eta = !light.ratios.empty();
    parallel_for(n, 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Rgb before(light.irradiance[0][i], light.irradiance[1][i], light.irradiance[2][i]);
        const Rgb after = (changes_eta ? change(before, light.ratios[i]) : before) * scale;
        for (std::size_t k = 0; k < 3; ++k) relit->irradiance[k][i] += after[static_cast<int>(k)];
        if (!has_errors || is_black(before)) continue;
        const float error = light.errors[i] * mean_channel(after) / mean_channel(before);
        relit->errors[i] = std::hypot(relit->errors[i], error);
      }
    });
  }
  relit->nodes.assign(group.nodes.begin(), group.nodes.end());
  for (std::size_t k = 0; k < 3; ++k) group.planes[7 + k] = relit->irradiance[k];
  sum_nodes(group, relit->nodes);
  group.nodes = relit->nodes;
  group.lights = {{"", {group.planes[7], group.planes[8], group.planes[9]}, relit->errors, {}}};
  group.eta = eta;
  return relit;
}

}  // namespace

bool serves_eta(const CacheGroup& group, double eta) noexcept {
  if (group.eta == eta) return true;
  return eta >= double{kLeastEta} && eta <= double{kMostEta} && group.eta >= double{kLeastEta} &&
         group.eta <= double{kMostEta} && !group.lights.empty() &&
         std::ranges::all_of(group.lights,
                             [&](const LightPlane& l) { return l.ratios.size() == group.size(); });
}

void relight(Cache& cache, std::span<const double> etas, std::span<const LightScale> scales) {
  for (std::size_t g = 0; g < cache.groups.size(); ++g) {
    CacheGroup& group = cache.groups[g];
    const bool scaled = std::ranges::any_of(
        group.lights, [&](const LightPlane& light) { return scale_of(scales, light.name) != kAsBaked; });
    if (!scaled && group.eta == etas[g]) continue;
    const auto owned = relight_group(group, etas[g], scales);
    cache.storage =
        std::make_shared<const std::pair<std::shared_ptr<const void>, std::shared_ptr<const void>>>(
            std::move(cache.storage), owned);
  }
}

float irradiance_error(const CacheGroup& group, std::size_t sample) noexcept {
  float error = 0;
  for (const LightPlane& light : group.lights)
    if (!light.errors.empty()) error = std::hypot(error, light.errors[sample]);
  return error;
}

}  // namespace nacre
