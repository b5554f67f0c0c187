// Reading cache files: what sections hold may be hostile, so every link and number is checked before use.
#include <atomic>
#include <charconv>
#include <limits>

#include "cache/cache_layout.h"
#include "cache/light_planes.h"
#include "nacre/base/error.h"
#include "nacre/base/parallel.h"
#include "nacre/cache/cache_file.h"

namespace nacre {
namespace {

// Rounding included: no scene reaches further, no normal is longer.
constexpr float kFarthest = 2e15f, kLongest = 1.001f;

// Whether all of `values` satisfy a condition, on all cores.
template <class T, class Condition>
bool all(std::span<const T> values, const Condition& condition) {
  std::atomic<bool> good{true};
  parallel_for(values.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    bool range_good = true;
    for (std::size_t i = begin; i < end; ++i) range_good &= condition(values[i]);
    if (!range_good) good = false;
  });
  return good;
}

void check_planes(const layout::SectionReader& reader, const CacheGroup& group, std::uint32_t index) {
  for (std::size_t k = 0; k < kPlaneCount; ++k) {
    const auto kind = layout::kPlanes[k];
    if (group.planes[k].size() != group.size()) reader.damaged(kind, index, "planes differ in length");
    const bool position = k < static_cast<std::size_t>(Plane::kNormalX),
               normal = !position && k < static_cast<std::size_t>(Plane::kArea);
    const float least = position ? -kFarthest
                        : normal ? -kLongest
                                 : 0,
                most = position ? kFarthest
                       : normal ? kLongest
                                : std::numeric_limits<float>::max();
    if (!all(group.planes[k], [&](float v) { return v >= least && v <= most; }))
      reader.damaged(kind, index,
                     position ? "a value is not finite, or a position further away than any scene reaches"
                     : normal ? "a value is not finite, or a normal longer than 1"
                              : "a value is negative or not finite");
  }
  // Infinite power times a vanished profile would not be a number.
  const auto areas = group.plane(Plane::kArea);
  for (const Plane p : {Plane::kIrradianceR, Plane::kIrradianceG, Plane::kIrradianceB})
    if (!all(group.plane(p), [&](const float& e) {
          return std::isfinite(e * areas[static_cast<std::size_t>(&e - group.plane(p).data())]);
        }))
      reader.damaged(layout::kPlanes[static_cast<std::size_t>(p)], index,
                     "irradiance times area is not finite");
}

// The breadth-first order makes each node's place in the tree known from the nodes before it, so one pass
// proves that the links form a tree over exactly the group's samples.
void check_nodes(const layout::SectionReader& reader, const CacheGroup& group, std::uint32_t index) {
  const auto bad = [&](const char* reason) { reader.damaged(layout::kNodes, index, reason); };
  const auto nodes = group.nodes;
  if (group.size() > kMaxSamplesPerGroup) bad("too many samples");
  if (nodes.empty() != (group.size() == 0)) bad("nodes and samples do not match");
  if (nodes.empty()) return;
  if (nodes[0].first_sample != 0 || nodes[0].sample_count() != group.size())
    bad("the root does not hold every sample");
  std::uint64_t next_child = 1, level_end = 1;
  int depth = 0;
  for (std::uint64_t n = 0; n < nodes.size(); ++n) {
    if (n == level_end) {
      level_end = next_child;
      if (++depth > kMaxOctreeDepth) bad("the tree is too deep");
    }
    const OctreeNode& node = nodes[n];
    const std::uint32_t children = node.child_count();
    if (children == 0) {
      if (node.first_child != 0) bad("a leaf has a child link");
      continue;
    }
    if (children > 8 || node.first_child != next_child || next_child + children > nodes.size())
      bad("a child link is wrong");
    std::uint64_t sample = node.first_sample;
    for (std::uint64_t c = next_child; c < next_child + children; ++c) {
      if (nodes[c].first_sample != sample || nodes[c].sample_count() == 0)
        bad("children do not divide their parent's samples");
      sample += nodes[c].sample_count();
    }
    if (sample != std::uint64_t{node.first_sample} + node.sample_count())
      bad("children do not divide their parent's samples");
    next_child += children;
  }
  if (next_child != nodes.size()) bad("nodes are left over");
  const auto finite = [](const OctreeNode& node) {
    bool good = node.radius >= 0 && node.radius <= 4 * kFarthest;
    for (int k = 0; k < 3; ++k) {
      good &= std::abs(node.centre[k]) <= kFarthest;
      for (const float v : {node.power[k], node.second_moment[k], node.first_moment[k]})
        good &= std::isfinite(v) && v >= 0;
    }
    return good;
  };
  if (!all(nodes, finite)) bad("a value is negative, not finite or further away than any scene reaches");
  // What a leaf says of its samples, where they are and what they add up to, and any other of its children.
  const auto is_sum = [&](const OctreeNode& node) {
    double furthest = 0, power[3]{};
    const Vec3d centre(node.centre[0], node.centre[1], node.centre[2]);
    for (std::uint32_t c = 0; c < node.child_count(); ++c)
      for (int k = 0; k < 3; ++k) power[k] += double{nodes[node.first_child + c].power[k]};
    const std::size_t first = node.first_sample, count = node.child_count() > 0 ? 0 : node.sample_count();
    for (std::size_t i = first; i < first + count; ++i) {
      furthest = std::max(furthest, (Vec3d(group.position(i)) - centre).length());
      const Rgb light = group.irradiance(i);
      for (int k = 0; k < 3; ++k) power[k] += double{light[k]} * double{group.area(i)};
    }
    constexpr double kRounding = 1e-4;
    bool good = furthest <= double{node.radius} + kRounding * (double{node.radius} + centre.length());
    for (int k = 0; k < 3; ++k)
      good &= std::abs(power[k] - double{node.power[k]}) <= kRounding * power[k] + 1e-36;
    return good;
  };
  if (!all(nodes, is_sum)) bad("a node does not say what is below it");
}

// Of a text that is nothing but a number of 0 or more; else -1.
double parse_amount(const std::string& text) {
  const char* end = text.data() + text.size();
  double value = -1;
  const auto parsed = std::from_chars(text.data(), end, value);
  return parsed.ec == std::errc() && parsed.ptr == end && std::isfinite(value) && value >= 0 ? value : -1;
}

// Name, area and, since version 2, eta and the names of lights.
void read_texts(const layout::SectionReader& reader, std::uint32_t index, CacheGroup& group) {
  const KeyValues entries = reader.texts(layout::kGroup, index);
  const bool first = reader.version() == 1;
  const auto has = [&](std::size_t i, const char* key) {
    return i < entries.size() && entries[i].first == key;
  };
  bool sound = has(0, "name") && has(1, "area") && (first ? entries.size() == 2 : has(2, "eta"));
  for (std::size_t i = 3; i < entries.size(); ++i) sound = sound && has(i, "light");
  if (!sound)
    reader.damaged(
        layout::kGroup, index,
        first ? "it does not hold a name and an area" : "it does not hold a name, area, eta and lights");
  group.name = entries[0].second;
  group.surface_area = parse_amount(entries[1].second);
  if (group.surface_area < 0)
    reader.damaged(layout::kGroup, index, "the surface area is not a number of 0 or more");
  if (first) return;
  // Scenes have floats, of which nine digits are enough to tell them apart.
  group.eta = double{static_cast<float>(parse_amount(entries[2].second))};
  if (group.eta < 0) reader.damaged(layout::kGroup, index, "eta is not a number of 0 or more");
  for (std::size_t i = 3; i < entries.size(); ++i) group.lights.emplace_back().name = entries[i].second;
}

// A section with `per_sample` elements for each light and sample, or with nothing.
template <class T>
std::span<const T> read_plane(const layout::SectionReader& reader, layout::Kind kind, std::uint32_t index,
                              const CacheGroup& group, std::size_t per_sample) {
  const auto values = reader.array<T>(kind, index);
  if (!values.empty() && values.size() != per_sample * group.lights.size() * group.size())
    reader.damaged(kind, index, "its size is not that of the samples times the lights");
  return values;
}

void read_lights(const layout::SectionReader& reader, std::uint32_t index, CacheGroup& group) {
  const std::size_t n = group.size(), count = group.lights.size();
  const auto irradiance = read_plane<float>(reader, layout::kLights, index, group, 3);
  if (irradiance.empty() != (n == 0 || count < 2))
    reader.damaged(layout::kLights, index, "it does not hold the irradiance of each of several lights");
  const auto errors = read_plane<float>(reader, layout::kErrors, index, group, 1);
  const auto ratios = read_plane<EtaRatios>(reader, layout::kRatios, index, group, 1);
  const auto sound = [](float v) { return std::isfinite(v) && v >= 0; };
  if (!all(irradiance, sound)) reader.damaged(layout::kLights, index, "a value is negative or not finite");
  if (!all(errors, sound)) reader.damaged(layout::kErrors, index, "a value is negative or not finite");
  point_lights_into(group, irradiance, errors, ratios);
}

CacheGroup read_group(const layout::SectionReader& reader, std::uint32_t index) {
  CacheGroup group;
  read_texts(reader, index, group);
  for (std::size_t k = 0; k < kPlaneCount; ++k)
    group.planes[k] = reader.array<float>(layout::kPlanes[k], index);
  group.nodes = reader.array<OctreeNode>(layout::kNodes, index);
  check_planes(reader, group, index);
  check_nodes(reader, group, index);
  if (reader.version() > 1) read_lights(reader, index, group);
  return group;
}

}  // namespace

Cache load_cache(const std::string& path, std::uint32_t* version) {
  const layout::SectionReader reader(path, layout::kCacheFiles);
  if (version) *version = reader.version();
  Cache cache;
  cache.fingerprint = reader.texts(layout::kFingerprint, 0);
  cache.info = reader.texts(layout::kInfo, 0);
  for (std::uint32_t g = 0; g < reader.group_count(); ++g) cache.groups.push_back(read_group(reader, g));
  cache.storage = reader.storage();
  return cache;
}

bool is_cache_file(const std::string& path) { return layout::has_magic(path, layout::kMagic); }

}  // namespace nacre
