// Descent of the octree.
#include "nacre/cache/exitance.h"

#include <cmath>

#include "nacre/base/parallel.h"

namespace nacre {
namespace {

// Deepest stack of a depth-first descent: seven siblings wait on each level.
constexpr int kStackSize = 7 * (kMaxOctreeDepth + 1) + 8;

// The estimate of a node's error takes all its samples to lie where the profile bends most and adds up errors
// that mostly cancel; what happens is smaller by this factor, about the same for every profile, material,
// shape (thin double sheets are the worst) and tolerance (tests/cache/exitance_test.cpp), which `tolerance`,
// a relative RMSE over a picture, makes use of.
constexpr double kCalibration = 6.5;

// The first guess opens nodes that are seen under more than this ratio of radius to distance.
constexpr float kGuessRatio2 = 0.7f * 0.7f;

struct Offset {
  float r2, near2;  // squared distances of the node's centre and of its nearest possible sample
};

Offset measure(const OctreeNode& node, const Vec3& x) noexcept {
  const float dx = x.x - node.centre[0], dy = x.y - node.centre[1], dz = x.z - node.centre[2];
  const float r2 = dx * dx + dy * dy + dz * dz;
  const float near = std::sqrt(r2) - node.radius;
  return {r2, near > 0 ? near * near : 0.0f};
}

Float4 load(const float (&channels)[3]) noexcept { return Float4{channels[0], channels[1], channels[2], 0}; }

bool is_dark(const OctreeNode& node) noexcept {
  return node.power[0] == 0 && node.power[1] == 0 && node.power[2] == 0;
}

// Partial sums are short and of one sign, so floats keep them; the whole is added up in double precision.
struct Sum {
  double v[3]{};
  void add(Float4 part) noexcept {
    for (int k = 0; k < 3; ++k) v[k] += static_cast<double>(part[k]);
  }
  Rgb rgb() const noexcept {
    return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
  }
};

// Depth first, children in order. `accept(node, part)` sets the part that a node stands for, or refuses it;
// then its children are asked, or `leaf(node)` its samples.
template <class Accept, class Leaf>
Sum descend(std::span<const OctreeNode> nodes, const Accept& accept, const Leaf& leaf) noexcept {
  Sum sum;
  std::uint32_t stack[kStackSize];
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const OctreeNode& node = nodes[stack[--top]];
    if (is_dark(node)) continue;
    Float4 part;
    if (accept(node, part))
      sum.add(part);
    else if (node.child_count() == 0)
      sum.add(leaf(node));
    else
      for (std::uint32_t c = node.child_count(); c-- > 0;) stack[top++] = node.first_child + c;
  }
  return sum;
}

}  // namespace

Exitance::Exitance(const CacheGroup& group, const Medium& medium, double tolerance)
    : group_(group),
      sources_(group.size()),
      kernel_(make_profiles(medium)),
      allowance_(tolerance * kCalibration) {
  // Samples whose own share a singular profile has to be averaged over are never hidden in a node.
  if (kernel_.singular() && group.size() > 0) {
    const auto areas = group.plane(Plane::kArea);
    nearest2_ = Kernel::disc_reach2(*std::max_element(areas.begin(), areas.end()));
  }
  parallel_for(group.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 p = group.position(i);
      const float area = group.area(i);
      const Rgb power = group.irradiance(i) * area;
      sources_[i] = {p.x, p.y, p.z, area, Float4{power.x, power.y, power.z, 0}};
    }
  });
}

Float4 Exitance::sum_samples(std::size_t begin, std::size_t end, const Vec3& x) const noexcept {
  Float4 sum = broadcast(0);
  const bool singular = kernel_.singular();
  for (std::size_t i = begin; i < end; ++i) {
    const Source& s = sources_[i];
    const float dx = x.x - s.x, dy = x.y - s.y, dz = x.z - s.z;
    const float r2 = dx * dx + dy * dy + dz * dz;
    sum += (singular ? kernel_.eval_disc(r2, s.area) : kernel_.eval(r2)) * s.power;
  }
  return sum;
}

// A first guess of the sum, from nodes seen under at most a fixed angle and from leaves as single points at
// the distance of their rim, or of half a sample's disc from where R has no bound: good to a factor of two,
// which is all that errors need to be measured against.
Float4 Exitance::guess(const Vec3& x, std::uint64_t& evaluations) const noexcept {
  const auto accept = [&](const OctreeNode& node, Float4& part) {
    const float r2 = measure(node, x).r2, radius2 = node.radius * node.radius;
    if (radius2 > kGuessRatio2 * r2 && node.child_count() > 0) return false;
    part = kernel_.eval(std::max({r2, radius2, nearest2_ / 64})) * load(node.power);
    ++evaluations;
    return true;
  };
  const Rgb sum = descend(group_.nodes, accept, [](const OctreeNode&) { return Float4{}; }).rgb();
  return Float4{sum.x, sum.y, sum.z, 0};
}

Rgb Exitance::eval(const Vec3& x, std::uint64_t& evaluations) const noexcept {
  if (group_.nodes.empty()) return {0, 0, 0};
  if (allowance_ <= 0) return eval_exact(x, evaluations);
  // A node may err by the allowance times half its own contribution and half the whole sum's share of its
  // power.
  const Float4 total = guess(x, evaluations);
  const OctreeNode& root = group_.nodes[0];
  const Float4 own = broadcast(static_cast<float>(0.5 * allowance_));
  Float4 share = own * total;
  for (int k = 0; k < 3; ++k) share[k] = root.power[k] > 0 ? share[k] / root.power[k] : 0.0f;

  const auto accept = [&](const OctreeNode& node, Float4& part) {
    const Offset offset = measure(node, x);
    if (offset.near2 <= nearest2_) return false;
    const Float4 power = load(node.power), r = kernel_.eval(offset.r2);
    const Kernel::Bounds& bounds = kernel_.bounds(offset.r2);
    const Float4 error =
        broadcast(0.5f) * load(node.second_moment) * bounds.hessian + load(node.first_moment) * bounds.slope;
    if (!all_at_most(error, power * (own * r + share))) return false;
    part = r * power;
    ++evaluations;
    return true;
  };
  const auto leaf = [&](const OctreeNode& node) {
    evaluations += node.sample_count();
    return sum_samples(node.first_sample, node.first_sample + node.sample_count(), x);
  };
  return descend(group_.nodes, accept, leaf).rgb();
}

Rgb Exitance::eval_exact(const Vec3& x, std::uint64_t& evaluations) const noexcept {
  Sum sum;
  constexpr std::size_t kRun = 64;
  for (std::size_t begin = 0; begin < group_.size(); begin += kRun)
    sum.add(sum_samples(begin, std::min(begin + kRun, group_.size()), x));
  evaluations += group_.size();
  return sum.rgb();
}

}  // namespace nacre
