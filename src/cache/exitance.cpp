// Descent of the octree.
#include "nacre/cache/exitance.h"

#include <cmath>

namespace nacre {
namespace {

// Deepest stack of a depth-first descent: seven siblings wait on each level.
constexpr int kStackSize = 7 * (kMaxOctreeDepth + 1) + 8;

// The bound holds for the worst arrangement of samples inside a node and adds up errors that mostly cancel;
// what happens is smaller by more than this factor (measured over the test scenes), which `tolerance`, a
// relative RMSE, makes use of.
constexpr double kCalibration = 8;

struct Offset {
  float r2, near2;  // squared distances of the node's centre and of its nearest possible sample
};

Offset measure(const OctreeNode& node, const Vec3& x) noexcept {
  const float dx = x.x - node.centre[0], dy = x.y - node.centre[1], dz = x.z - node.centre[2];
  const float r2 = dx * dx + dy * dy + dz * dz;
  const float near = std::sqrt(r2) - node.radius;
  return {r2, near > 0 ? near * near : 0.0f};
}

bool is_dark(const OctreeNode& node) noexcept {
  return node.power[0] == 0 && node.power[1] == 0 && node.power[2] == 0;
}

}  // namespace

Exitance::Exitance(const CacheGroup& group, const Medium& medium, double tolerance)
    : group_(group), kernel_(make_profiles(medium)), allowance_(tolerance * kCalibration) {}

void Exitance::add_samples(const OctreeNode& node, const Vec3& x, std::array<double, 3>& sum) const noexcept {
  const std::size_t begin = node.first_sample, end = begin + node.sample_count();
  const float* px = group_.planes[0].data();
  const float* py = group_.planes[1].data();
  const float* pz = group_.planes[2].data();
  const float* area = group_.planes[6].data();
  for (std::size_t i = begin; i < end; ++i) {
    const float dx = x.x - px[i], dy = x.y - py[i], dz = x.z - pz[i];
    const float r2 = dx * dx + dy * dy + dz * dz;
    const Kernel::Triple r = kernel_.singular() ? kernel_.eval_disc(r2, area[i]) : kernel_.eval(r2);
    for (std::size_t k = 0; k < 3; ++k)
      sum[k] += static_cast<double>(r.v[k] * group_.planes[7 + k][i] * area[i]);
  }
}

// A first guess of the sum, from nodes seen under at most a fixed angle: what errors are measured against.
Rgb Exitance::estimate(const Vec3& x, std::uint64_t& evaluations) const noexcept {
  std::array<double, 3> sum{};
  std::uint32_t stack[kStackSize];
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const OctreeNode& node = group_.nodes[stack[--top]];
    if (is_dark(node)) continue;
    const Offset offset = measure(node, x);
    if (node.radius * node.radius < 0.25f * offset.r2) {
      const Kernel::Triple r = kernel_.eval(offset.r2);
      for (std::size_t k = 0; k < 3; ++k) sum[k] += static_cast<double>(r.v[k] * node.power[k]);
      ++evaluations;
    } else if (node.child_count() == 0) {
      add_samples(node, x, sum);
      evaluations += node.sample_count();
    } else {
      for (std::uint32_t c = node.child_count(); c-- > 0;) stack[top++] = node.first_child + c;
    }
  }
  return {static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2])};
}

Rgb Exitance::eval(const Vec3& x, std::uint64_t& evaluations) const noexcept {
  if (group_.nodes.empty()) return {0, 0, 0};
  if (allowance_ <= 0) return eval_exact(x, evaluations);
  const Rgb guess = estimate(x, evaluations);
  // A node may err by the allowance times half its own contribution and half the whole sum's share of its
  // power.
  const OctreeNode& root = group_.nodes[0];
  float own[3], share[3];
  for (int k = 0; k < 3; ++k) {
    own[k] = static_cast<float>(0.5 * allowance_);
    share[k] = root.power[k] > 0 ? own[k] * guess[k] / root.power[k] : 0.0f;
  }

  std::array<double, 3> sum{};
  std::uint32_t stack[kStackSize];
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const OctreeNode& node = group_.nodes[stack[--top]];
    if (is_dark(node)) continue;
    const Offset offset = measure(node, x);
    if (offset.near2 > 0) {
      const Kernel::Triple r = kernel_.eval(offset.r2);
      const Kernel::Bounds& bounds = kernel_.bounds(offset.near2);
      bool good = true;
      for (int k = 0; k < 3; ++k) {
        const float error =
            0.5f * node.second_moment[k] * bounds.hessian[k] + node.first_moment[k] * bounds.slope[k];
        good = good && error <= node.power[k] * (own[k] * r.v[k] + share[k]);
      }
      if (good) {
        for (std::size_t k = 0; k < 3; ++k) sum[k] += static_cast<double>(r.v[k] * node.power[k]);
        ++evaluations;
        continue;
      }
    }
    if (node.child_count() == 0) {
      add_samples(node, x, sum);
      evaluations += node.sample_count();
    } else {
      for (std::uint32_t c = node.child_count(); c-- > 0;) stack[top++] = node.first_child + c;
    }
  }
  return {static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2])};
}

Rgb Exitance::eval_exact(const Vec3& x, std::uint64_t& evaluations) const noexcept {
  std::array<double, 3> sum{};
  if (!group_.nodes.empty()) add_samples(group_.nodes[0], x, sum);
  evaluations += group_.size();
  return {static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2])};
}

}  // namespace nacre
