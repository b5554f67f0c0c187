// Morton order, breadth-first subdivision, moments.
#include "nacre/cache/octree.h"

#include <atomic>
#include <numeric>

#include "cache/light_planes.h"
#include "cache/morton.h"
#include "nacre/base/error.h"
#include "nacre/base/parallel.h"

namespace nacre {
namespace {

// Which sample comes i-th; empty where they are in order already, as those of a bake are.
using Order = std::vector<std::uint32_t>;

template <class Body>
void for_each_index(std::size_t count, const Body& body) {
  parallel_for(count, 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) body(i);
  });
}

// Codes are computed whenever they are asked for: kept, they would be a sixteenth of all the memory that a
// bake takes.
class MortonCode {
 public:
  explicit MortonCode(std::span<const Vec3> positions) {
    for (const Vec3& p : positions) box_.extendBy(p);
    const Vec3 size = box_.size();
    const double extent = std::max({size.x, size.y, size.z});
    to_cells_ = extent > 0 ? 0x1p21 / extent : 0;
  }
  std::uint64_t operator()(const Vec3& p) const {
    return cell(p.x, box_.min.x) | cell(p.y, box_.min.y) << 1 | cell(p.z, box_.min.z) << 2;
  }

 private:
  std::uint64_t cell(float value, float low) const {
    return spread_bits(static_cast<std::uint64_t>(
        std::clamp((static_cast<double>(value) - low) * to_cells_, 0.0, 0x1p21 - 1)));
  }
  Box3 box_;
  double to_cells_;
};

Order sort_by_code(std::span<const Vec3> positions, const MortonCode& code_of) {
  std::atomic<bool> in_order{true};
  parallel_for(positions.size(), 4096, [&](std::size_t begin, std::size_t end) {
    std::uint64_t last = code_of(positions[begin ? begin - 1 : 0]);
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint64_t code = code_of(positions[i]);
      if (code < last) in_order.store(false, std::memory_order_relaxed);
      last = code;
    }
  });
  if (in_order) return {};
  struct Keyed {
    std::uint64_t code;
    std::uint32_t index;
  };
  std::vector<Keyed> keyed(positions.size());
  for_each_index(keyed.size(), [&](std::size_t i) {
    keyed[i] = {code_of(positions[i]), static_cast<std::uint32_t>(i)};
  });
  parallel_sort(keyed.begin(), keyed.end(), [](const Keyed& a, const Keyed& b) {
    return a.code != b.code ? a.code < b.code : a.index < b.index;
  });
  Order order(keyed.size());
  for_each_index(keyed.size(), [&](std::size_t i) { order[i] = keyed[i].index; });
  return order;
}

// The tree's shape: breadth first, so that a level's nodes follow the level before it.
std::vector<OctreeNode> divide(const CacheGroup& group, const MortonCode& code_of) {
  const auto count = static_cast<std::uint32_t>(group.size());
  std::vector<OctreeNode> nodes;
  if (count == 0) return nodes;
  // About two fifths as many as samples are usual on a surface; growing would copy all of them.
  nodes.reserve(count / 2 + 16);
  nodes.push_back({});
  nodes[0].packed_counts = count;
  std::size_t level_begin = 0;
  for (int depth = 0; depth < kMaxOctreeDepth && level_begin < nodes.size(); ++depth) {
    const std::size_t level_end = nodes.size();
    const int shift = 3 * (kMaxOctreeDepth - 1 - depth);
    for (std::size_t n = level_begin; n < level_end; ++n) {
      const std::uint32_t first = nodes[n].first_sample;
      const std::uint32_t last = first + nodes[n].sample_count();
      if (last - first <= kMaxLeafSamples) continue;
      const auto first_child = static_cast<std::uint32_t>(nodes.size());
      for (std::uint32_t begin = first; begin < last;) {
        const auto octant_of = [&](std::uint32_t i) { return code_of(group.position(i)) >> shift; };
        const std::uint64_t octant = octant_of(begin);
        std::uint32_t end = begin + 1;
        for (std::uint32_t above = last; end < above;) {
          const std::uint32_t middle = end + (above - end) / 2;
          if (octant_of(middle) == octant)
            end = middle + 1;
          else
            above = middle;
        }
        OctreeNode child{};
        child.first_sample = begin;
        child.packed_counts = end - begin;
        nodes.push_back(child);
        begin = end;
      }
      nodes[n].first_child = first_child;
      nodes[n].packed_counts |= (static_cast<std::uint32_t>(nodes.size()) - first_child) << 28;
    }
    level_begin = level_end;
  }
  return nodes;
}

// Sums in double precision, in sample order: the bits depend on neither threads nor the tree above.
void compute_moments(const CacheGroup& group, OctreeNode& node) {
  const std::size_t begin = node.first_sample, end = begin + node.sample_count();
  double weight = 0, area = 0;
  Vec3d weighted(0, 0, 0), plain(0, 0, 0);
  std::array<double, 3> power{};
  for (std::size_t i = begin; i < end; ++i) {
    const double a = group.area(i);
    const Rgb e = group.irradiance(i);
    const Vec3d x(group.position(i));
    const double w = a * (static_cast<double>(e.x) + e.y + e.z);
    weight += w;
    weighted += x * w;
    area += a;
    plain += x * a;
    for (int k = 0; k < 3; ++k) power[static_cast<std::size_t>(k)] += a * e[k];
  }
  const Vec3 centre(weight > 0 ? weighted / weight : area > 0 ? plain / area : Vec3d(group.position(begin)));
  double radius2 = 0;
  std::array<double, 3> second{};
  std::array<Vec3d, 3> first{Vec3d(0, 0, 0), Vec3d(0, 0, 0), Vec3d(0, 0, 0)};
  for (std::size_t i = begin; i < end; ++i) {
    const Vec3d offset = Vec3d(group.position(i)) - Vec3d(centre);
    const double d2 = offset.length2();
    const Rgb e = group.irradiance(i);
    radius2 = std::max(radius2, d2);
    for (std::size_t k = 0; k < 3; ++k) {
      const double w = static_cast<double>(group.area(i)) * e[static_cast<int>(k)];
      second[k] += w * d2;
      first[k] += offset * w;
    }
  }
  // Rounded up, so that the radius still bounds and the moments still dominate.
  const auto round_up = [](double x) { return x > 0 ? std::nextafter(static_cast<float>(x), 3e38f) : 0.0f; };
  node.radius = round_up(std::sqrt(radius2));
  for (int k = 0; k < 3; ++k) {
    const auto kk = static_cast<std::size_t>(k);
    node.centre[k] = centre[k];
    node.power[k] = static_cast<float>(power[kk]);
    node.second_moment[k] = round_up(second[kk]);
    node.first_moment[k] = round_up(first[kk].length());
  }
}

// `values` in order, and then they are gone.
template <class T, class U, class Store>
void sort_into(const Order& order, std::vector<T>& values, std::span<U> sorted, const Store& store) {
  for_each_index(values.size(),
                 [&](std::size_t i) { store(sorted, i, values[order.empty() ? i : order[i]]); });
  std::vector<T>().swap(values);
}

// Everything that a group's spans point to.
struct OwnedGroup {
  std::array<std::vector<float>, kPlaneCount> planes;
  std::vector<float> light_irradiance, errors;  // of all lights, one after the other
  std::vector<EtaRatios> ratios;
  std::vector<OctreeNode> nodes;
};

template <class Triple>
void sort_triples(const Order& order, std::vector<Triple>& values, std::span<float> x, std::span<float> y,
                  std::span<float> z) {
  sort_into(order, values, x, [&](std::span<float>, std::size_t i, const Triple& v) {
    x[i] = v.x;
    y[i] = v.y;
    z[i] = v.z;
  });
}

// What of all lights is kept in one vector, which that of a single light becomes if it is in order already:
// ratios are a third of all that a sample takes.
template <class T>
void sort_of_lights(const Order& order, std::size_t n, std::vector<SampleLight>& lights,
                    std::vector<T> SampleLight::*member, std::vector<T>& sorted) {
  if (order.empty() && lights.size() == 1) {
    sorted = std::move(lights[0].*member);
    return;
  }
  sorted.resize(n * lights.size());
  for (std::size_t l = 0; l < lights.size(); ++l)
    sort_into(order, lights[l].*member, std::span(sorted).subspan(l * n, n),
              [](std::span<T> to, std::size_t i, const T& value) { to[i] = value; });
}

void sort_lights(const Order& order, std::vector<SampleLight>& lights, OwnedGroup& owned, CacheGroup& group) {
  const std::size_t n = group.size(), count = lights.size();
  const auto all = [&](auto member) {
    return std::ranges::all_of(lights, [&](const SampleLight& light) { return (light.*member).size() == n; });
  };
  const bool apart = count > 1;
  if (apart) owned.light_irradiance.resize(3 * n * count);
  for (std::size_t l = 0; l < count; ++l) {
    group.lights.emplace_back().name = lights[l].name;
    const auto channel = [&](std::size_t k) {
      return std::span(owned.light_irradiance).subspan((3 * l + k) * n, n);
    };
    if (apart) sort_triples(order, lights[l].irradiance, channel(0), channel(1), channel(2));
  }
  if (all(&SampleLight::errors)) sort_of_lights(order, n, lights, &SampleLight::errors, owned.errors);
  if (all(&SampleLight::ratios)) sort_of_lights(order, n, lights, &SampleLight::ratios, owned.ratios);
  point_lights_into(group, owned.light_irradiance, owned.errors, owned.ratios);
}

}  // namespace

double hexagonal_spacing(double area, double count) {
  return count > 0 ? std::sqrt(2 / std::sqrt(3.0) * area / count) : 0;
}

std::vector<std::uint32_t> octree_order(std::span<const Vec3> positions) {
  Order order = sort_by_code(positions, MortonCode(positions));
  if (order.empty()) {
    order.resize(positions.size());
    std::iota(order.begin(), order.end(), 0u);
  }
  return order;
}

void sum_nodes(const CacheGroup& group, std::span<OctreeNode> nodes) {
  parallel_for(nodes.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) compute_moments(group, nodes[n]);
  });
}

CacheGroup build_group(std::string name, double surface_area, SurfaceSamples samples,
                       std::vector<std::shared_ptr<const void>>& storage) {
  if (samples.size() > kMaxSamplesPerGroup)
    fail(ErrorCode::kLimit, name, "{} samples in one group; the most is {}", samples.size(),
         kMaxSamplesPerGroup);
  const auto owned = std::make_shared<OwnedGroup>();
  const MortonCode code_of(samples.positions);
  const Order order = sort_by_code(samples.positions, code_of);
  // Samples are gone as planes come, before there are nodes: that is what takes most memory at once.
  const std::size_t count = samples.size();
  CacheGroup group;
  group.name = std::move(name);
  group.surface_area = surface_area;
  const auto add_planes = [&](std::size_t first, auto& triples) {
    for (std::size_t k = first; k < first + 3; ++k) {
      owned->planes[k].resize(count);
      group.planes[k] = owned->planes[k];
    }
    sort_triples(order, triples, std::span(owned->planes[first]), std::span(owned->planes[first + 1]),
                 std::span(owned->planes[first + 2]));
  };
  add_planes(0, samples.positions);
  add_planes(3, samples.normals);
  auto& areas = owned->planes[static_cast<std::size_t>(Plane::kArea)];
  areas.resize(count);
  group.planes[static_cast<std::size_t>(Plane::kArea)] = areas;
  sort_into(order, samples.areas, std::span(areas),
            [](std::span<float> sorted, std::size_t i, float area) { sorted[i] = area; });
  add_planes(7, samples.irradiance);
  sort_lights(order, samples.lights, *owned, group);
  owned->nodes = divide(group, code_of);
  sum_nodes(group, owned->nodes);
  group.nodes = owned->nodes;
  storage.push_back(owned);
  return group;
}

}  // namespace nacre
