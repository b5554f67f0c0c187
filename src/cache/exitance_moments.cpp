// Second moments of the samples below each node of an octree.
#include <algorithm>
#include <cmath>

#include "nacre/base/parallel.h"
#include "nacre/cache/exitance.h"

namespace nacre {

// Moments of the samples below a node about its centre, channel by channel.
struct Exitance::Moments {
  struct Channel {
    double power = 0;
    Vec3d first{0, 0, 0};
    std::array<double, 6> second{};  // xx yy zz yz zx xy

    void add(const Channel& from, const Vec3d& d) {
      const Vec3d& m = from.first;
      const double p = from.power;
      power += p;
      first += m + d * p;
      const std::array<double, 6> moved{d.x * (2 * m.x + p * d.x),         d.y * (2 * m.y + p * d.y),
                                        d.z * (2 * m.z + p * d.z),         d.y * m.z + d.z * (m.y + p * d.y),
                                        d.z * m.x + d.x * (m.z + p * d.z), d.x * m.y + d.y * (m.x + p * d.x)};
      for (std::size_t i = 0; i < 6; ++i) second[i] += from.second[i] + moved[i];
    }
  };
  std::array<Channel, 3> channels;
};

// Those of node `index`, written into it and into all below but the ones `known` (sorted), which have
// `moments`.
Exitance::Moments Exitance::add_moments(std::uint32_t index, std::span<const std::uint32_t> known,
                                        std::span<const Moments> moments) {
  const auto at = std::ranges::lower_bound(known, index);
  if (at != known.end() && *at == index) return moments[static_cast<std::size_t>(at - known.begin())];
  SumNode& node = nodes_[index];
  const Vec3d centre(node.x, node.y, node.z);
  Moments sum;
  for (std::uint32_t c = 0; c < node.child_count(); ++c) {
    const SumNode& child = nodes_[node.first + c];
    const Moments below = add_moments(node.first + c, known, moments);
    for (std::size_t k = 0; k < 3; ++k)
      sum.channels[k].add(below.channels[k], Vec3d(child.x, child.y, child.z) - centre);
  }
  if (node.child_count() == 0)
    for (std::uint32_t i = node.first; i < node.first + node.sample_count(); ++i) {
      const SumSource& s = sources_[i];
      for (std::size_t k = 0; k < 3; ++k) {
        Moments::Channel sample;
        sample.power = static_cast<double>(s.power[static_cast<int>(k)]);
        sum.channels[k].add(sample, Vec3d(s.x, s.y, s.z) - centre);
      }
    }
  double power = 0;
  std::array<double, 6> mean{};
  for (const Moments::Channel& channel : sum.channels) {
    power += channel.power;
    for (std::size_t i = 0; i < 6; ++i) mean[i] += channel.second[i];
  }
  if (!(power > 0)) return sum;
  for (double& m : mean) m *= 0.5 / power;
  double tint2 = 0;
  for (const Moments::Channel& channel : sum.channels) {
    if (!(channel.power > 0)) continue;
    double norm2 = 0;
    for (std::size_t i = 0; i < 6; ++i)
      norm2 += (i < 3 ? 1 : 2) * square(0.5 * channel.second[i] / channel.power - mean[i]);
    tint2 = std::max(tint2, norm2);
  }
  node.xx = static_cast<float>(mean[0]);
  node.yy = static_cast<float>(mean[1]);
  node.zz = static_cast<float>(mean[2]);
  node.yz = static_cast<float>(mean[3]);
  node.zx = static_cast<float>(mean[4]);
  node.xy = static_cast<float>(mean[5]);
  // Not less for rounding, of the numbers above either, nor for that of the tables they are multiplied with.
  node.tint = static_cast<float>(1.0000005 * std::sqrt(tint2)) + moment_slack_ * node.spread;
  return sum;
}

void Exitance::make_nodes() {
  nodes_.resize(group_.nodes.size());
  parallel_for(nodes_.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const OctreeNode& from = group_.nodes[i];
      SumNode& node = nodes_[i];
      node = SumNode{};
      node.x = from.centre[0];
      node.y = from.centre[1];
      node.z = from.centre[2];
      node.radius = from.radius;
      node.first = from.child_count() > 0 ? from.first_child : from.first_sample;
      node.packed_counts = from.packed_counts;
      node.power = Float4{from.power[0], from.power[1], from.power[2], 0};
      node.spread = -1;
      for (int k = 0; k < 3; ++k)
        if (from.power[k] > 0) {
          // Rounded up by more than division and the bounds' product lose.
          node.spread = std::max(node.spread, 0.5000003f * from.second_moment[k] / from.power[k]);
          node.lean = std::max(node.lean, 1.0000005f * from.first_moment[k] / from.power[k]);
        }
    }
  });
  // Subtrees side by side, then what is above them.
  constexpr std::size_t kSubtrees = 256;
  std::vector<std::uint32_t> roots{0};
  for (std::size_t i = 0; i < roots.size() && roots.size() < kSubtrees;) {
    const SumNode& node = nodes_[roots[i]];
    if (node.child_count() == 0) {
      ++i;
      continue;
    }
    roots.erase(roots.begin() + static_cast<std::ptrdiff_t>(i));
    for (std::uint32_t c = 0; c < node.child_count(); ++c) roots.push_back(node.first + c);
  }
  std::ranges::sort(roots);
  std::vector<Moments> moments(roots.size());
  parallel_for(roots.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) moments[i] = add_moments(roots[i], {}, {});
  });
  add_moments(0, roots, moments);
}

}  // namespace nacre
