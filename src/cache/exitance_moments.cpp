// Second moments of the samples below each node of an octree.
#include <algorithm>
#include <cmath>

#include "nacre/base/parallel.h"
#include "nacre/cache/exitance.h"

namespace nacre {

// Moments of the samples below a node about its centre, channels side by side.
struct Exitance::Moments {
  Float4 power = broadcast(0);
  std::array<Float4, 3> first{power, power, power};
  std::array<Float4, 6> second{power, power, power, power, power, power};  // xx yy zz yz zx xy

  void add_sample(const Float4& p, const Vec3& d) {
    const std::array<Float4, 3> moved{p * broadcast(d.x), p * broadcast(d.y), p * broadcast(d.z)};
    power += p;
    for (std::size_t i = 0; i < 3; ++i) first[i] += moved[i];
    second[0] += moved[0] * broadcast(d.x);
    second[1] += moved[1] * broadcast(d.y);
    second[2] += moved[2] * broadcast(d.z);
    second[3] += moved[1] * broadcast(d.z);
    second[4] += moved[2] * broadcast(d.x);
    second[5] += moved[0] * broadcast(d.y);
  }

  float tint(const SumNode& node) const;

  // Those of a part whose own are about a point at `d`.
  void add(const Moments& part, const Vec3& d) {
    const std::array<Float4, 3>& m = part.first;
    const Float4 x = broadcast(d.x), y = broadcast(d.y), z = broadcast(d.z);
    add_sample(part.power, d);
    for (std::size_t i = 0; i < 3; ++i) first[i] += m[i];
    second[0] += part.second[0] + broadcast(2) * m[0] * x;
    second[1] += part.second[1] + broadcast(2) * m[1] * y;
    second[2] += part.second[2] + broadcast(2) * m[2] * z;
    second[3] += part.second[3] + m[1] * z + m[2] * y;
    second[4] += part.second[4] + m[2] * x + m[0] * z;
    second[5] += part.second[5] + m[0] * y + m[1] * x;
  }
};

// Those of node `index`, written into it and into all below but the ones `known` (sorted), which have
// `moments`; with `other_light`, the power of each source under one, what nodes know is widened to hold for
// that as well.
Exitance::Moments Exitance::add_moments(std::uint32_t index, std::span<const std::uint32_t> known,
                                        std::span<const Moments> moments,
                                        std::span<const Float4> other_light) {
  if (!known.empty()) {
    const auto at = std::ranges::lower_bound(known, index);
    if (at != known.end() && *at == index) return moments[static_cast<std::size_t>(at - known.begin())];
  }
  SumNode& node = nodes_[index];
  const Vec3 centre(node.x, node.y, node.z);
  Moments sum;
  for (std::uint32_t c = 0; c < node.child_count(); ++c) {
    const SumNode& child = nodes_[node.first + c];
    sum.add(add_moments(node.first + c, known, moments, other_light),
            Vec3(child.x, child.y, child.z) - centre);
  }
  if (node.child_count() == 0)
    for (std::uint32_t i = node.first; i < node.first + node.sample_count(); ++i) {
      const SumSource& s = sources_[i];
      sum.add_sample(other_light.empty() ? s.power : other_light[i], Vec3(s.x, s.y, s.z) - centre);
    }
  other_light.empty() ? set_moments(node, sum) : widen_moments(node, sum);
  return sum;
}

namespace {

float of_all(const Float4& channels) { return channels[0] + channels[1] + channels[2]; }

}  // namespace

// The largest norm of what a channel's second moments differ by from those of a node.
float Exitance::Moments::tint(const SumNode& node) const {
  const std::array<float, 6> mean{node.xx, node.yy, node.zz, node.yz, node.zx, node.xy};
  // Without light in a channel, nothing there differs.
  const auto lit = power > broadcast(0);
  const Float4 per_power = lit ? broadcast(0.5f) / power : broadcast(0);
  Float4 norm2 = broadcast(0);
  for (std::size_t i = 0; i < 6; ++i) {
    const Float4 difference = second[i] * per_power - broadcast(mean[i]);
    norm2 += broadcast(i < 3 ? 1 : 2) * difference * difference;
  }
  float largest2 = 0;
  for (int k = 0; k < 3; ++k)
    if (power[k] > 0) largest2 = std::max(largest2, norm2[k]);
  return std::sqrt(largest2);
}

void Exitance::set_moments(SumNode& node, const Moments& sum) const {
  const float power = of_all(sum.power);
  if (!(power > 0)) return;
  std::array<float, 6> mean;
  for (std::size_t i = 0; i < 6; ++i) mean[i] = 0.5f * of_all(sum.second[i]) / power;
  node.xx = mean[0];
  node.yy = mean[1];
  node.zz = mean[2];
  node.yz = mean[3];
  node.zx = mean[4];
  node.xy = mean[5];
  // Not less for rounding, here or in the numbers above, nor for that of the tables they are multiplied with.
  node.tint = sum.tint(node) + moment_slack_ * node.spread;
}

void Exitance::widen_moments(SumNode& node, const Moments& sum) const {
  for (int k = 0; k < 3; ++k) {
    if (!(sum.power[k] > 0)) continue;
    const float trace = sum.second[0][k] + sum.second[1][k] + sum.second[2][k];
    const Vec3 first(sum.first[0][k], sum.first[1][k], sum.first[2][k]);
    node.spread = std::max(node.spread, 0.5f * trace / sum.power[k]);
    node.lean = std::max(node.lean, first.length() / sum.power[k]);
  }
  node.tint = std::max(node.tint, sum.tint(node) + moment_slack_ * node.spread);
}

void Exitance::add_all_moments(std::span<const Float4> other_light) {
  // Subtrees side by side, then what is above them.
  constexpr std::size_t kSubtrees = 256;
  std::vector<std::uint32_t> roots{0}, inner;
  for (std::size_t i = 0; i < roots.size() && roots.size() - i < kSubtrees; ++i) {
    const SumNode& node = nodes_[roots[i]];
    for (std::uint32_t c = 0; c < node.child_count(); ++c) roots.push_back(node.first + c);
    if (node.child_count() > 0) inner.push_back(roots[i]);
  }
  std::ranges::sort(roots);
  std::ranges::sort(inner);
  std::erase_if(roots, [&](std::uint32_t index) { return std::ranges::binary_search(inner, index); });
  std::vector<Moments> moments(roots.size());
  parallel_for(roots.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) moments[i] = add_moments(roots[i], {}, {}, other_light);
  });
  add_moments(0, roots, moments, other_light);
}

}  // namespace nacre
