// Descent of the octree, shared by all points of a block and of a cell of space.
#include "nacre/cache/exitance.h"

#include <algorithm>
#include <cmath>

#include "cache/local_expansion.h"
#include "cache/morton.h"
#include "nacre/base/parallel.h"

namespace nacre {
namespace {

// Deepest stack of a depth-first descent: seven siblings wait on each level.
constexpr int kStackSize = 7 * (kMaxOctreeDepth + 1) + 8;

// The estimate of a node's error takes all its samples to lie where the profile bends most and adds up errors
// that mostly cancel; what happens is smaller by this factor, about the same for every profile, material,
// shape (thin double sheets are the worst) and tolerance (tests/cache/exitance_test.cpp), which `tolerance`,
// a relative RMSE over a picture, makes use of.
constexpr double kCalibration = 10;

// The first guess opens nodes that are seen under more than this ratio of radius to distance.
constexpr float kGuessRatio2 = 0.7f * 0.7f;

// A series may err in the corners of its cell; in the rest of it, and over all directions, it errs by this
// share of the bound on its third derivatives.
constexpr float kSeriesWeight = 0.2f;

// Points per cell above which smaller ones are cheaper.
constexpr double kPointsPerCell = 20;

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
void descend(std::span<const OctreeNode> nodes, std::uint32_t from, const Accept& accept, const Leaf& leaf) {
  std::uint32_t stack[kStackSize];
  int top = 0;
  stack[top++] = from;
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
  Box3 box;
  for (std::size_t i = 0; i < group.size(); ++i) box.extendBy(group.position(i));
  const Vec3 size = box.size();
  // Whole blocks around all samples, and no more than 2^20 cells an axis.
  cell_size_ = std::max(kCellSpacings * spacing, 0x1p-20 * double{std::max({size.x, size.y, size.z})});
  if (!(cell_size_ > 0)) cell_size_ = 1;
  for (int axis = 0; axis < 3; ++axis)
    origin_[axis] = (std::floor(double{box.min[axis]} / cell_size_) - (1 << kBlockLevels)) * cell_size_;
  parallel_for(group.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 p = group.position(i);
      const float area = group.area(i);
      const Rgb power = group.irradiance(i) * area;
      sources_[i] = {p.x, p.y, p.z, area, Float4{power.x, power.y, power.z, 0}};
    }
  });
}

std::uint64_t Exitance::cell_code(const Vec3& x) const noexcept {
  std::uint64_t code = 0;
  for (int axis = 0; axis < 3; ++axis)
    code |= spread_bits(static_cast<std::uint64_t>(
                std::clamp((static_cast<double>(x[axis]) - origin_[axis]) / cell_size_, 0.0, 0x1p21 - 1)))
            << axis;
  return code;
}

int Exitance::leaf_level_for(double points) const noexcept {
  const double cells = group_.surface_area / square(cell_size_ * (1 << kLeafLevel));
  const double finer = std::log(points / std::max(cells, 1.0) / kPointsPerCell) / std::log(4.0);
  return std::clamp(kLeafLevel - static_cast<int>(std::lround(finer)), 0, kLeafLevel);
}

bool Exitance::in_grid(const Vec3& x) const noexcept {
  const Vec3d offset = (Vec3d(x) - origin_) / cell_size_;
  return std::min({offset.x, offset.y, offset.z}) >= 0 && std::max({offset.x, offset.y, offset.z}) < 0x1p21;
}

// A block (level kBlockLevels), a cell (level 0) or one between: what all its points share.
struct Exitance::Target {
  Vec3 centre;
  float radius;
  LocalExpansion far;                  // of what is far from all of it
  std::vector<std::uint32_t> pending;  // octree nodes that its parts deal with
};

struct Exitance::Room {
  std::span<const Vec3> points;
  std::span<Rgb> exitance;
  int leaf_level;
  std::array<Target, kBlockLevels + 1> targets;
  std::vector<Source> list;
  std::uint64_t evaluations = 0;
};

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
  descend(group_.nodes, 0, accept, [](const OctreeNode&) {});
  return sum;
}

// Sums up for the points of one block or cell, which follow each other.
void Exitance::eval_target(std::span<const Point> range, int level, const Target* parent, Room& room) const {
  Target& target = room.targets[static_cast<std::size_t>(level)];
  const double size = cell_size_ * static_cast<double>(1 << level);
  for (int axis = 0; axis < 3; ++axis)
    target.centre[axis] = static_cast<float>(
        origin_[axis] + (static_cast<double>(gather_bits(range[0].code >> axis) >> level) + 0.5) * size);
  target.radius = static_cast<float>(size * std::sqrt(0.75));
  target.far = parent ? parent->far.moved(target.centre - parent->centre) : LocalExpansion{};
  target.pending.clear();
  room.list.clear();

  // A node may err by the allowance times half its own contribution and half the whole sum's share of its
  // power.
  const Float4 total = guess(target.centre, room.evaluations);
  const OctreeNode& root = group_.nodes[0];
  const Float4 own = broadcast(static_cast<float>(0.5 * allowance_));
  Float4 share = own * total;
  for (int k = 0; k < 3; ++k) share[k] = root.power[k] > 0 ? share[k] / root.power[k] : 0.0f;
  const Float4 half = broadcast(0.5f),
               series = broadcast(kSeriesWeight * target.radius * target.radius * target.radius / 6);

  const auto accept = [&](const OctreeNode& node) {
    const Vec3 offset = target.centre - Vec3(node.centre[0], node.centre[1], node.centre[2]);
    const float r2 = dot(offset, offset);
    // From the point of the target that is nearest to the node's centre.
    const float near = std::sqrt(r2) - target.radius;
    if (near > node.radius && square(near - node.radius) > nearest2_) {
      const Float4 power = load(node.power);
      const Kernel::Bounds& bounds = kernel_.bounds(near * near);
      const Float4 error =
          half * load(node.second_moment) * bounds.hessian + load(node.first_moment) * bounds.slope;
      const Float4 allowed = power * (own * kernel_.eval(r2) + share);
      if (all_at_most(error + power * bounds.third * series, allowed)) {
        target.far.add(power, kernel_.eval_jet(r2), offset);
        ++room.evaluations;
        return true;
      }
      if (all_at_most(error, allowed)) {
        if (level == room.leaf_level)
          room.list.push_back({node.centre[0], node.centre[1], node.centre[2], 0, power});
        else
          target.pending.push_back(static_cast<std::uint32_t>(&node - group_.nodes.data()));
        return true;
      }
    }
    // Smaller targets are further away.
    if (level == room.leaf_level || (node.radius > target.radius && node.child_count() > 0)) return false;
    target.pending.push_back(static_cast<std::uint32_t>(&node - group_.nodes.data()));
    return true;
  };
  const auto leaf = [&](const OctreeNode& node) {
    const auto first = sources_.begin() + node.first_sample;
    room.list.insert(room.list.end(), first, first + node.sample_count());
  };
  if (parent)
    for (const std::uint32_t node : parent->pending) descend(group_.nodes, node, accept, leaf);
  else
    descend(group_.nodes, 0, accept, leaf);

  if (level == room.leaf_level) {
    for (const Point& point : range) {
      const Vec3& x = room.points[point.index];
      const Float4 far = target.far.eval(x - target.centre);
      room.exitance[point.index] = sum(room.list, x) + Rgb(far[0], far[1], far[2]);
    }
    room.evaluations += room.list.size() * range.size();
    return;
  }
  const int shift = 3 * (level - 1);
  for (std::size_t begin = 0; begin < range.size();) {
    std::size_t end = begin + 1;
    while (end < range.size() && range[end].code >> shift == range[begin].code >> shift) ++end;
    eval_target(range.subspan(begin, end - begin), level - 1, &target, room);
    begin = end;
  }
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

void Exitance::eval(std::span<const Vec3> points, std::span<Rgb> exitance, std::uint64_t& evaluations,
                    int leaf_level) const {
  if (allowance_ <= 0 || group_.nodes.empty()) return eval_exact(points, exitance, evaluations);
  std::vector<Point> order;
  order.reserve(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    if (in_grid(points[i]))
      order.push_back({cell_code(points[i]), i});
    else  // far away from all samples, where no surface is
      eval_exact(points.subspan(i, 1), exitance.subspan(i, 1), evaluations);
  }
  std::ranges::sort(order, {}, &Point::code);
  Room room{points, exitance, leaf_level, {}, {}, 0};
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = begin + 1;
    while (end < order.size() && block_of(order[end].code) == block_of(order[begin].code)) ++end;
    eval_target(std::span(order).subspan(begin, end - begin), kBlockLevels, nullptr, room);
    begin = end;
  }
  evaluations += room.evaluations;
}

void Exitance::eval_exact(std::span<const Vec3> points, std::span<Rgb> exitance,
                          std::uint64_t& evaluations) const {
  for (std::size_t i = 0; i < points.size(); ++i) exitance[i] = sum(sources_, points[i]);
  evaluations += points.size() * sources_.size();
}

}  // namespace nacre
