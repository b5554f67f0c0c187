// The octree of a cache as the inner loops read it, down to what a material can tell apart.
#include <algorithm>
#include <bit>
#include <cmath>

#include "nacre/base/parallel.h"
#include "nacre/cache/exitance.h"

namespace nacre {
namespace {

// Nodes that are copied side by side.
constexpr std::size_t kRun = 4096;

// What a grain may err by, as a share of what a node is allowed that is seen from a distance: it is looked at
// from everywhere.
constexpr double kGrainShare = 1.0 / 16;

// A node without its tensor and what is below it.
SumNode make_node(const OctreeNode& from) noexcept {
  SumNode node{};
  node.x = from.centre[0];
  node.y = from.centre[1];
  node.z = from.centre[2];
  node.radius = from.radius;
  node.power = Float4{from.power[0], from.power[1], from.power[2], 0};
  node.spread = -1;
  for (int k = 0; k < 3; ++k)
    if (from.power[k] > 0) {
      // Rounded up by more than division and the bounds' product lose.
      node.spread = std::max(node.spread, 0.5000003f * from.second_moment[k] / from.power[k]);
      node.lean = std::max(node.lean, 1.0000005f * from.first_moment[k] / from.power[k]);
    }
  return node;
}

SumSource make_grain(const OctreeNode& from) noexcept {
  return {from.centre[0], from.centre[1], from.centre[2], 0,
          Float4{from.power[0], from.power[1], from.power[2], 0}};
}

// What follows a node: nodes, or the sources of a leaf.
enum class Below : std::uint8_t { kChildren, kGrains, kSamples, kItself };

}  // namespace

// Nodes so much narrower than R_d, whose derivatives come to `bend` and `slope` times itself at most, that
// they may stand for their samples wherever they are looked at from.
struct Exitance::Grains {
  float bend = 0, slope = 0, allowed = 0;

  bool contain(const OctreeNode& from) const noexcept {
    const SumNode node = make_node(from);
    return allowed > 0 && node.spread * bend + node.lean * slope <= allowed;
  }
  Below below(const Exitance& sum, std::uint32_t index) const noexcept {
    const OctreeNode from = sum.make_octree_node(index);
    if (contain(from)) return Below::kItself;
    if (from.child_count() == 0) return Below::kSamples;
    for (std::uint32_t c = 0; c < from.child_count(); ++c)
      if (!contain(sum.make_octree_node(from.first_child + c))) return Below::kChildren;
    return Below::kGrains;
  }
};

SumSource Exitance::make_source(std::size_t sample) const noexcept {
  const Vec3 p = unit_ * group_.position(sample);
  const Rgb power = group_.irradiance(sample) * (unit_ * unit_ * group_.area(sample));
  return {p.x, p.y, p.z, 0, Float4{power.x, power.y, power.z, 0}};
}

OctreeNode Exitance::make_octree_node(std::uint32_t index) const noexcept {
  OctreeNode node = group_.nodes[index];
  const float area = unit_ * unit_;
  node.radius *= unit_;
  for (std::size_t i = 0; i < 3; ++i) {
    node.centre[i] *= unit_;
    node.power[i] *= area;
    node.first_moment[i] *= area * unit_;
    node.second_moment[i] *= area * area;
  }
  return node;
}

// None where each sample has to be certain, or counts by itself.
Exitance::Grains Exitance::find_grains() const {
  Grains grains;
  if (promise_ == Promise::kCertified) return grains;
  for (const Guide& guide : guides_) {
    const Kernel& kernel = kernels_[guide.kernel];
    const DistanceBins bins = kernel.bound_bins();
    for (std::int32_t bin = bins.first; bin < bins.last; ++bin) {
      const Kernel::Bounds& bounds = kernel.bounds(std::bit_cast<float>(bin << bins.shift));
      const Float4 least = kernel.eval(std::bit_cast<float>((bin + 1) << bins.shift));
      for (int k = 0; k < 3; ++k)
        if (least[k] > 0) {
          grains.bend = std::max(grains.bend, bounds.hessian[k] / least[k]);
          grains.slope = std::max(grains.slope, bounds.slope[k] / least[k]);
        }
    }
  }
  grains.allowed = static_cast<float>(kGrainShare * allowance_);
  return grains;
}

// Level by level. Of ten million samples most are below grains, and are not even read.
void Exitance::copy_octree() {
  const Grains grains = find_grains();
  nodes_ = LargeArray<SumNode>(group_.nodes.size());  // at most: memory is taken where it is written
  sources_ = LargeArray<SumSource>(group_.size());
  struct Place {
    Below below;
    std::uint32_t child, source;  // the first of each
  };
  std::vector<Place> places;
  std::vector<std::uint32_t> level{0}, next;  // indices in the cache
  for (std::uint32_t begin = 0, source = 0; !level.empty(); level.swap(next)) {
    places.resize(level.size());
    parallel_for(level.size(), kRun, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) places[i].below = grains.below(*this, level[i]);
    });
    const auto end = begin + static_cast<std::uint32_t>(level.size());
    std::uint32_t child = end;
    for (std::size_t i = 0; i < level.size(); ++i) {
      places[i].child = child;
      places[i].source = source;
      const OctreeNode& from = group_.nodes[level[i]];
      switch (places[i].below) {
        case Below::kChildren:
          child += from.child_count();
          break;
        case Below::kGrains:
          source += from.child_count();
          break;
        case Below::kSamples:
          source += from.sample_count();
          break;
        case Below::kItself:
          ++source;
      }
    }
    next.resize(child - end);
    parallel_for(level.size(), kRun, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) {
        const OctreeNode from = make_octree_node(level[i]);
        const Place& place = places[i];
        SumNode node = make_node(from);
        node.first = place.source;
        SumSource* const to = sources_.data() + place.source;
        switch (place.below) {
          case Below::kChildren:
            node.first = place.child;
            node.packed_counts = from.child_count() << SumNode::kChildShift;
            for (std::uint32_t c = 0; c < from.child_count(); ++c)
              next[place.child - end + c] = from.first_child + c;
            break;
          case Below::kGrains:
            node.packed_counts = from.child_count();
            for (std::uint32_t c = 0; c < from.child_count(); ++c)
              to[c] = make_grain(make_octree_node(from.first_child + c));
            break;
          case Below::kSamples:
            node.packed_counts = from.sample_count();
            for (std::uint32_t s = 0; s < from.sample_count(); ++s)
              to[s] = make_source(from.first_sample + s);
            break;
          case Below::kItself:
            node.packed_counts = 1;
            to[0] = make_grain(from);
        }
        nodes_[begin + i] = node;
      }
    });
    begin = end;
  }
}

}  // namespace nacre
