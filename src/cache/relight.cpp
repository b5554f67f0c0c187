// Sums over planes of light.
#include "nacre/cache/relight.h"

#include <algorithm>
#include <cmath>

#include "cache/light_planes.h"
#include "nacre/base/error.h"
#include "nacre/base/parallel.h"
#include "nacre/cache/octree.h"

namespace nacre {
namespace {

const Rgb kAsBaked(1, 1, 1);

Rgb scale_of(std::span<const LightScale> scales, const std::string& name) {
  const auto found = std::ranges::find(scales, name, &LightScale::name);
  return found == scales.end() ? kAsBaked : found->scale;
}

// What spans of a cache point to from now on, beside what they did before.
void keep_alive(Cache& cache, std::shared_ptr<const void> owned) {
  cache.storage = std::make_shared<const std::pair<std::shared_ptr<const void>, std::shared_ptr<const void>>>(
      std::move(cache.storage), std::move(owned));
}

using IrradiancePlanes = std::array<std::vector<float>, 3>;

struct RelitGroup {
  IrradiancePlanes irradiance;
  std::vector<float> errors;
  std::vector<OctreeNode> nodes;
};

bool is_changed(const CacheGroup& group, double eta, std::span<const LightScale> scales) {
  return group.eta != eta || std::ranges::any_of(group.lights, [&](const LightPlane& light) {
           return scale_of(scales, light.name) != kAsBaked;
         });
}

// Lights summed up. Their errors are independent of each other, and multiplied by what the irradiance was on
// average; none if `errors` is nullptr.
IrradiancePlanes sum_lights(const CacheGroup& group, double eta, std::span<const LightScale> scales,
                            std::vector<float>* errors) {
  const std::size_t n = group.size();
  IrradiancePlanes sum;
  for (auto& plane : sum) plane.assign(n, 0);
  const bool has_errors =
      errors && std::ranges::all_of(group.lights, [&](const LightPlane& l) { return l.errors.size() == n; });
  if (has_errors) errors->assign(n, 0);
  const EtaChange change(group.eta, eta);
  for (const LightPlane& light : group.lights) {
    const Rgb scale = scale_of(scales, light.name);
    const bool changes_eta = !light.ratios.empty();
    parallel_for(n, 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Rgb before(light.irradiance[0][i], light.irradiance[1][i], light.irradiance[2][i]);
        const Rgb after = (changes_eta ? change(before, light.ratios[i]) : before) * scale;
        for (std::size_t k = 0; k < 3; ++k) sum[k][i] += after[static_cast<int>(k)];
        if (!has_errors || is_black(before)) continue;
        const float error = light.errors[i] * mean_channel(after) / mean_channel(before);
        (*errors)[i] = std::hypot((*errors)[i], error);
      }
    });
  }
  return sum;
}

std::shared_ptr<const RelitGroup> relight_group(CacheGroup& group, double eta,
                                                std::span<const LightScale> scales) {
  const auto relit = std::make_shared<RelitGroup>();
  relit->irradiance = sum_lights(group, eta, scales, &relit->errors);
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
    if (!is_changed(group, etas[g], scales)) continue;
    keep_alive(cache, relight_group(group, etas[g], scales));
  }
}

Cache ScaledCache::relit(std::span<const double> etas) const {
  Cache result = cache;
  relight(result, etas, scales);
  return result;
}

std::array<std::vector<float>, 3> ScaledCache::irradiance(std::size_t g, double eta) const {
  const CacheGroup& group = cache.groups[g];
  if (is_changed(group, eta, scales)) return sum_lights(group, eta, scales, nullptr);
  IrradiancePlanes planes;
  for (std::size_t k = 0; k < 3; ++k)
    planes[k].assign(group.planes[7 + k].begin(), group.planes[7 + k].end());
  return planes;
}

namespace {

struct ExtendedGroup {
  std::array<std::vector<float>, 3> irradiance;
  std::vector<float> light_irradiance, errors;
  std::vector<EtaRatios> ratios;
  std::vector<OctreeNode> nodes;
};

// The values of all planes, one after the other; nothing where one of them has none.
template <class T, class Member>
std::vector<T> join(const std::vector<LightPlane>& lights, std::size_t n, const Member& member) {
  std::vector<T> joined;
  for (const LightPlane& light : lights) {
    const std::span<const T> values = member(light);
    if (values.size() != n) return {};
    joined.insert(joined.end(), values.begin(), values.end());
  }
  return joined;
}

std::shared_ptr<const ExtendedGroup> append_group(CacheGroup& group, const CacheGroup& more) {
  const std::size_t n = group.size();
  const auto extended = std::make_shared<ExtendedGroup>();
  for (std::size_t k = 0; k < 3; ++k) {
    extended->irradiance[k].resize(n);
    for (std::size_t i = 0; i < n; ++i)
      extended->irradiance[k][i] = group.planes[7 + k][i] + more.planes[7 + k][i];
  }
  group.lights.insert(group.lights.end(), more.lights.begin(), more.lights.end());
  extended->errors = join<float>(group.lights, n, [](const LightPlane& l) { return l.errors; });
  extended->ratios = join<EtaRatios>(group.lights, n, [](const LightPlane& l) { return l.ratios; });
  for (const LightPlane& light : group.lights)
    for (const auto& channel : light.irradiance)
      extended->light_irradiance.insert(extended->light_irradiance.end(), channel.begin(), channel.end());
  point_lights_into(group, extended->light_irradiance, extended->errors, extended->ratios);
  extended->nodes.assign(group.nodes.begin(), group.nodes.end());
  for (std::size_t k = 0; k < 3; ++k) group.planes[7 + k] = extended->irradiance[k];
  sum_nodes(group, extended->nodes);
  group.nodes = extended->nodes;
  return extended;
}

bool keeps_lights_apart(const CacheGroup& group) {
  return !group.lights.empty() &&
         std::ranges::none_of(group.lights, [](const LightPlane& light) { return light.name.empty(); });
}

}  // namespace

void append_lights(Cache& cache, const Cache& more, const std::string& place) {
  if (cache.groups.size() != more.groups.size())
    fail(ErrorCode::kMismatch, place, "has {} groups, and the scene {}", cache.groups.size(),
         more.groups.size());
  for (std::size_t g = 0; g < cache.groups.size(); ++g) {
    const CacheGroup &own = cache.groups[g], &other = more.groups[g];
    if (!keeps_lights_apart(own) || !keeps_lights_apart(other))
      fail(ErrorCode::kMismatch, place,
           "the cache does not keep its lights apart; bake it again with --per-light");
    bool same = own.size() == other.size() && own.eta == other.eta;
    for (std::size_t k = 0; same && k <= static_cast<std::size_t>(Plane::kArea); ++k)
      same = std::ranges::equal(own.planes[k], other.planes[k]);
    if (!same)
      fail(ErrorCode::kMismatch, place,
           "its samples of {} are not those that this bake has; give the --seed and density that it was "
           "baked with",
           own.name);
  }
  for (std::size_t g = 0; g < cache.groups.size(); ++g)
    keep_alive(cache, append_group(cache.groups[g], more.groups[g]));
  cache.fingerprint = more.fingerprint;
}

float irradiance_error(const CacheGroup& group, std::size_t sample) noexcept {
  float error = 0;
  for (const LightPlane& light : group.lights)
    if (!light.errors.empty()) error = std::hypot(error, light.errors[sample]);
  return error;
}

}  // namespace nacre
