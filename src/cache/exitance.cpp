// Descent of the octree, once for all points of a cell of space, and the sum over what it finds.
#include "nacre/cache/exitance.h"

#include <algorithm>
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

// Side of a cell in hexagonal spacings of the samples: larger cells are shared by more points, smaller ones
// have shorter lists.
constexpr double kCellSpacings = 1;

float distance2(const OctreeNode& node, const Vec3& x) noexcept {
  const float dx = x.x - node.centre[0], dy = x.y - node.centre[1], dz = x.z - node.centre[2];
  return dx * dx + dy * dy + dz * dz;
}

Float4 load(const float (&channels)[3]) noexcept { return Float4{channels[0], channels[1], channels[2], 0}; }

bool is_dark(const OctreeNode& node) noexcept {
  return node.power[0] == 0 && node.power[1] == 0 && node.power[2] == 0;
}

// Depth first, children in order; dark nodes are left out. `accept(node)` says that a node will do as it is;
// otherwise its children are asked, or `leaf(node)` deals with its samples.
template <class Accept, class Leaf>
void descend(std::span<const OctreeNode> nodes, const Accept& accept, const Leaf& leaf) {
  std::uint32_t stack[kStackSize];
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const OctreeNode& node = nodes[stack[--top]];
    if (is_dark(node) || accept(node)) continue;
    if (node.child_count() == 0)
      leaf(node);
    else
      for (std::uint32_t c = node.child_count(); c-- > 0;) stack[top++] = node.first_child + c;
  }
}

}  // namespace

Exitance::Exitance(const CacheGroup& group, const Medium& medium, double tolerance)
    : group_(group),
      sources_(group.size()),
      kernel_(make_profiles(medium)),
      allowance_(tolerance * kCalibration) {
  if (group.size() == 0) return;
  // Samples whose own share a singular profile has to be averaged over are never hidden in a node.
  if (kernel_.singular()) {
    const auto areas = group.plane(Plane::kArea);
    nearest2_ = Kernel::disc_reach2(*std::max_element(areas.begin(), areas.end()));
  }
  const double spacing = hexagonal_spacing(group.surface_area, static_cast<double>(group.size()));
  if (spacing > 0) cell_size_ = kCellSpacings * spacing;
  parallel_for(group.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 p = group.position(i);
      const float area = group.area(i);
      const Rgb power = group.irradiance(i) * area;
      sources_[i] = {p.x, p.y, p.z, area, Float4{power.x, power.y, power.z, 0}};
    }
  });
}

Exitance::CellIndex Exitance::cell_of(const Vec3& x) const noexcept {
  CellIndex cell;
  for (int axis = 0; axis < 3; ++axis)
    cell[static_cast<std::size_t>(axis)] = static_cast<std::int32_t>(
        std::clamp(std::floor(static_cast<double>(x[axis]) / cell_size_), -2e9, 2e9));
  return cell;
}

// A first guess of the sum, from nodes seen under at most a fixed angle and from leaves as single points at
// the distance of their rim, or of half a sample's disc from where R has no bound: good to a factor of two,
// which is all that errors need to be measured against.
Float4 Exitance::guess(const Vec3& centre, std::uint64_t& evaluations) const noexcept {
  Float4 sum = broadcast(0);
  const auto accept = [&](const OctreeNode& node) {
    const float r2 = distance2(node, centre), radius2 = node.radius * node.radius;
    if (radius2 > kGuessRatio2 * r2 && node.child_count() > 0) return false;
    sum += kernel_.eval(std::max({r2, radius2, nearest2_ / 64})) * load(node.power);
    ++evaluations;
    return true;
  };
  descend(group_.nodes, accept, [](const OctreeNode&) {});
  return sum;
}

void Exitance::collect(const CellIndex& cell, std::vector<Source>& list, std::uint64_t& evaluations) const {
  list.clear();
  Vec3 centre;
  for (int axis = 0; axis < 3; ++axis)
    centre[axis] = static_cast<float>((cell[static_cast<std::size_t>(axis)] + 0.5) * cell_size_);
  const float cell_radius = static_cast<float>(cell_size_ * std::sqrt(0.75));

  // A node may err by the allowance times half its own contribution and half the whole sum's share of its
  // power.
  const Float4 total = guess(centre, evaluations);
  const OctreeNode& root = group_.nodes[0];
  const Float4 own = broadcast(static_cast<float>(0.5 * allowance_));
  Float4 share = own * total;
  for (int k = 0; k < 3; ++k) share[k] = root.power[k] > 0 ? share[k] / root.power[k] : 0.0f;

  const auto accept = [&](const OctreeNode& node) {
    const float distance = std::sqrt(distance2(node, centre));
    const float near =
        distance - cell_radius;  // from the point of the cell that is nearest to the node's centre
    if (near <= node.radius || square(near - node.radius) <= nearest2_) return false;
    const Float4 power = load(node.power);
    const Kernel::Bounds& bounds = kernel_.bounds(near * near);
    const Float4 error =
        broadcast(0.5f) * load(node.second_moment) * bounds.hessian + load(node.first_moment) * bounds.slope;
    if (!all_at_most(error, power * (own * kernel_.eval(distance * distance) + share))) return false;
    list.push_back({node.centre[0], node.centre[1], node.centre[2], 0, power});
    return true;
  };
  const auto leaf = [&](const OctreeNode& node) {
    const auto first = sources_.begin() + node.first_sample;
    list.insert(list.end(), first, first + node.sample_count());
  };
  descend(group_.nodes, accept, leaf);
}

// Runs of one sign and of a few terms are kept by floats; the whole is added up in double precision.
Rgb Exitance::sum(std::span<const Source> list, const Vec3& x) const noexcept {
  constexpr std::size_t kRun = 64;
  const bool singular = kernel_.singular();
  double total[3]{};
  for (std::size_t begin = 0; begin < list.size(); begin += kRun) {
    Float4 part = broadcast(0);
    for (const Source& s : list.subspan(begin, std::min(kRun, list.size() - begin))) {
      const float dx = x.x - s.x, dy = x.y - s.y, dz = x.z - s.z;
      const float r2 = dx * dx + dy * dy + dz * dz;
      part += (singular ? kernel_.eval_disc(r2, s.area) : kernel_.eval(r2)) * s.power;
    }
    for (int k = 0; k < 3; ++k) total[k] += static_cast<double>(part[k]);
  }
  return {static_cast<float>(total[0]), static_cast<float>(total[1]), static_cast<float>(total[2])};
}

void Exitance::eval(std::span<const Vec3> points, std::span<Rgb> exitance, std::uint64_t& evaluations) const {
  if (allowance_ <= 0 || group_.nodes.empty()) return eval_exact(points, exitance, evaluations);
  std::vector<std::pair<CellIndex, std::uint32_t>> order(points.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = {cell_of(points[i]), i};
  std::sort(order.begin(), order.end());
  std::vector<Source> list;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i == 0 || order[i].first != order[i - 1].first) collect(order[i].first, list, evaluations);
    exitance[order[i].second] = sum(list, points[order[i].second]);
    evaluations += list.size();
  }
}

void Exitance::eval_exact(std::span<const Vec3> points, std::span<Rgb> exitance,
                          std::uint64_t& evaluations) const {
  for (std::size_t i = 0; i < points.size(); ++i) exitance[i] = sum(sources_, points[i]);
  evaluations += points.size() * sources_.size();
}

}  // namespace nacre
