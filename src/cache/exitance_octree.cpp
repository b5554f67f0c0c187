// The octree of a cache as the inner loops read it, down to what a material can tell apart.
#include <algorithm>
#include <bit>
#include <cmath>
#include <map>

#include "cache/kernel_set.h"
#include "nacre/base/parallel.h"
#include "nacre/cache/exitance.h"

namespace nacre {
namespace {

// Nodes that are copied side by side.
constexpr std::size_t kRun = 4096;

// What a grain may err by, as a share of what a node is allowed that is seen from a distance: it is looked at
// from everywhere.
constexpr double kGrainShare = 1.0 / 16;

// Marks a source that is a node of the octree.
constexpr std::uint32_t kGrainBit = 0x80000000u;

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

// Level by level. Of ten million samples most are below grains, and are not even read. Returns what each
// source is: a sample, or with kGrainBit the octree's node of that index.
std::vector<std::uint32_t> Exitance::copy_octree() {
  const Grains grains = find_grains();
  nodes_ = LargeArray<SumNode>(group_.nodes.size());  // at most: memory is taken where it is written
  sources_ = LargeArray<SumSource>(group_.size());
  struct Place {
    Below below;
    std::uint32_t child, source;  // the first of each
  };
  std::vector<Place> places;
  std::vector<std::uint32_t> origins;
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
    origins.resize(source);
    parallel_for(level.size(), kRun, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) {
        const OctreeNode from = make_octree_node(level[i]);
        const Place& place = places[i];
        SumNode node = make_node(from);
        node.first = place.source;
        SumSource* const to = sources_.data() + place.source;
        std::uint32_t* const origin = origins.data() + place.source;
        switch (place.below) {
          case Below::kChildren:
            node.first = place.child;
            node.packed_counts = from.child_count() << SumNode::kChildShift;
            for (std::uint32_t c = 0; c < from.child_count(); ++c)
              next[place.child - end + c] = from.first_child + c;
            break;
          case Below::kGrains:
            node.packed_counts = from.child_count();
            for (std::uint32_t c = 0; c < from.child_count(); ++c) {
              to[c] = make_grain(make_octree_node(from.first_child + c));
              origin[c] = kGrainBit | (from.first_child + c);
            }
            break;
          case Below::kSamples:
            node.packed_counts = from.sample_count();
            for (std::uint32_t s = 0; s < from.sample_count(); ++s) {
              to[s] = make_source(from.first_sample + s);
              origin[s] = from.first_sample + s;
            }
            break;
          case Below::kItself:
            node.packed_counts = 1;
            to[0] = make_grain(from);
            origin[0] = kGrainBit | level[i];
        }
        nodes_[begin + i] = node;
      }
    });
    begin = end;
    node_count_ = end;
  }
  source_count_ = origins.size();
  return origins;
}

// The power of each source under the light for an index of refraction.
std::vector<Float4> Exitance::source_powers(std::span<const std::uint32_t> origins, double eta,
                                            const IrradianceForEta& irradiance) const {
  const std::array<std::vector<float>, 3> planes = irradiance(eta);
  std::vector<Float4> powers(origins.size());
  parallel_for(origins.size(), kRun, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      std::uint32_t first = origins[i], count = 1;
      if (first & kGrainBit) {
        const OctreeNode& grain = group_.nodes[first & ~kGrainBit];
        first = grain.first_sample;
        count = grain.sample_count();
      }
      Vec3d sum(0, 0, 0);
      for (std::size_t s = first; s < first + count; ++s)
        for (int k = 0; k < 3; ++k)
          sum[k] += double{planes[static_cast<std::size_t>(k)][s]} * double{group_.area(s)};
      sum *= square(double{unit_});
      powers[i] = Float4{static_cast<float>(sum.x), static_cast<float>(sum.y), static_cast<float>(sum.z), 0};
    }
  });
  return powers;
}

// Moments are those of the least index; they hold for all others if they do for the largest. Rows are read
// for each kernel, so each has what its own index gives.
void Exitance::make_powers(std::span<const std::uint32_t> origins, double most_eta,
                           const IrradianceForEta& irradiance) {
  add_all_moments(source_powers(origins, most_eta, irradiance));
  const std::size_t width = set_->row_width();
  row_width_ = width;
  powers_ = LargeArray<float>((source_count_ + node_count_) * width);
  parallel_for(source_count_ + node_count_, kRun, [&](std::size_t begin, std::size_t end) {
    std::fill(powers_.data() + begin * width, powers_.data() + end * width, 0.0f);
  });
  for (std::uint32_t light = 0; light < light_etas_.size(); ++light) {
    std::map<std::size_t, std::size_t> columns;  // and their channels
    set_->for_each_column(light, [&](std::size_t column, std::size_t k) { columns[column] = k; });
    const std::vector<Float4> powers = source_powers(origins, light_etas_[light], irradiance);
    parallel_for(powers.size(), kRun, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        for (const auto& [column, k] : columns) powers_[i * width + column] = powers[i][k];
    });
  }
  for (std::uint32_t i = 0; i < source_count_; ++i) sources_[i].power = with_row(sources_[i].power, i);
  // Children come after their parents.
  for (std::size_t n = node_count_; n-- > 0;) {
    const SumNode& node = nodes_[n];
    const bool is_leaf = node.child_count() == 0;
    float* const to = powers_.data() + (source_count_ + n) * width;
    const float* from = powers_.data() + (is_leaf ? node.first : source_count_ + node.first) * width;
    const std::uint32_t count = is_leaf ? node.sample_count() : node.child_count();
    for (std::uint32_t c = 0; c < count; ++c, from += width)
      for (std::size_t lane = 0; lane < width; ++lane) to[lane] += from[lane];
  }
}

}  // namespace nacre
