// Descent of the octree, shared by all points of a block and of a cell of space.
#include "nacre/cache/exitance.h"

#include <algorithm>
#include <cmath>

#include "cache/kernel_set.h"
#include "cache/local_expansion.h"
#include "cache/morton.h"
#include "cache/sum_lanes.h"

namespace nacre {
namespace {

// Nodes are opened for the guess of a sum if seen under more than this ratio of radius to distance, and for
// its lower bound.
constexpr float kGuessRatio = 0.7f, kBoundRatio = 0.2f;

// What a node's third moments and the change of its second ones over a target come to, for the same reasons
// as kCalibration, as long as its radius is at most this share of its distance.
constexpr float kMomentWeight = 0.1f, kRatio = 0.35f;

// In the dark all of a sum is far away: nothing is added up sample by sample, and a few nodes towards the
// light are most of it, so that errors cancel less. From this darkness on less is allowed, down to
// three tenths. From the second on tables are interpolated: what R_d falls by within a cell of theirs no
// longer cancels either.
constexpr double kDim = 1.5, kDark = 4, kDarkest = 6, kDarkening = 0.5;

// Largest cells that take over the guess of the cell around them.
constexpr int kInheritLevel = 1;

// Points in a cell of so many distances of samples above which smaller ones are cheaper; where samples are
// denser, fewer are.
constexpr double kPointsPerCell = 32, kSpacingsPerCell = 2;

}  // namespace

// A block (level kBlockLevels), a cell (level 0) or one between: what all its points share.
struct Exitance::Target {
  Vec3 centre;
  float radius;          // of a ball around all its points
  LocalExpansion far;    // of what is far from all of it
  SetExpansion set_far;  // the same for each material of a family
  Totals total;          // about what the sum is, by guide
  double darkness;
  IndexList pending;  // octree nodes that its parts deal with
};

struct Exitance::Room {
  std::span<const Vec3> points;
  std::span<Rgb> exitance;
  bool whole;
  std::array<Target, kBlockLevels + 1> targets;
  SortedNodes nodes;
  SourceList list;
  std::vector<Limits> limits;  // of the target at hand
  std::vector<double> totals;  // of a point
  std::vector<float> far, combined;
  std::uint64_t evaluations = 0;
};

void Exitance::place(Target& target, std::span<const Point> range, int level, const Room& room) const {
  if (room.whole && level <= kWholeLevel) {
    Box3 box;
    for (const Point& point : range) box.extendBy(room.points[point.index]);
    target.centre = box.center();
    float radius2 = 0;
    for (const Point& point : range)
      radius2 = std::max(radius2, (room.points[point.index] - target.centre).length2());
    target.radius = std::sqrt(radius2);
  } else {
    const double size = cell_size_ * static_cast<double>(1 << level);
    for (int axis = 0; axis < 3; ++axis)
      target.centre[axis] = static_cast<float>(
          origin_[axis] + (static_cast<double>(gather_bits(range[0].code >> axis) >> level) + 0.5) * size);
    target.radius = static_cast<float>(size * std::sqrt(0.75));
  }
  // What rounding of positions, distances and roots may take away.
  const Vec3& c = target.centre;
  target.radius = 1.000001f * target.radius + 1e-6f * std::max({std::abs(c.x), std::abs(c.y), std::abs(c.z)});
}

// A guess of each guide's sum at the target's centre, good to a factor of two, which is all that errors need
// to be measured against; or, certified, a lower bound for all its points.
Exitance::Totals Exitance::weigh(const Target& target, Room& room) const {
  const bool certified = promise_ == Promise::kCertified;
  const CoarseTest test{nodes_.data(), target.centre, certified ? kBoundRatio : kGuessRatio, certified,
                        target.radius};
  std::array<KernelTables, kMostGuides> tables;
  for (std::size_t g = 0; g < guides_.size(); ++g) tables[g] = kernels_[guides_[g].kernel].tables();
  Totals totals;
  totals.fill(broadcast(0));
  room.nodes.work.clear();
  room.nodes.work.push(0);
  while (room.nodes.work.size() > 0) {
    room.nodes.opened.clear();
    room.evaluations +=
        lanes::add_coarsely(std::span(tables).first(guides_.size()), test, room.nodes, totals);
    room.nodes.work.clear();
    for (const std::uint32_t index : room.nodes.opened.span())
      room.nodes.work.push_run(nodes_[index].first, nodes_[index].child_count());
  }
  return totals;
}

// How many times darker than the mean of the surface it is there, as a logarithm, in the darkest channel.
double Exitance::find_darkness(const Totals& totals) const {
  if (promise_ == Promise::kCertified) return 0;
  double least = 1;
  for (std::size_t g = 0; g < guides_.size(); ++g)
    for (int k = 0; k < 3; ++k)
      if (const Rgb& lit = guides_[g].lit; lit[k] > 0)
        least = std::min(least, double{totals[g][k]} / double{lit[k]});
  return -std::log(std::max(least, 1e-30));
}

// What nodes may err by at every distance, the least of all guides.
void Exitance::make_limits(const Target& target, Room& room) const {
  const double allowed = 1 / (1 + kDarkening * std::clamp(target.darkness - kDim, 0.0, kDarkest - kDim));
  // Series err by the cube of the radius: a share of what is allowed is that of a larger target.
  const double radius_scale = 1 / std::cbrt(allowed);
  const double classes = std::ceil(
      kRadiiPerOctave * std::log2(radius_scale * double{target.radius} / (kSmallestRadius * cell_size_)));
  std::array<LimitTerm, 3 * kMostGuides> terms;
  std::size_t count = 0;
  for (std::size_t g = 0; g < guides_.size(); ++g) {
    const Guide& guide = guides_[g];
    const Radius& radius = guide.radii[static_cast<std::size_t>(
        std::clamp(classes, 0.0, static_cast<double>(guide.radii.size() - 1)))];
    for (std::size_t k = 0; k < 3; ++k) {
      if (!guide.limits[k]) continue;
      const auto channel = static_cast<int>(k);
      const float share =
          static_cast<float>(0.5 * allowance_) * target.total[g][channel] / nodes_[0].power[channel];
      terms[count++] = {share, guide.per_third[k].data(), radius.as_point[k].data(),
                        radius.in_series[k].data()};
    }
  }
  room.limits.resize(lean_.size());
  lanes::make_limits(std::span(terms).first(count), lean_.data(), bend_.data(), static_cast<float>(allowed),
                     lean_.size(), room.limits.data());
  // All that is nearer than the bins reach.
  room.limits[0].as_point = room.limits[0].in_series = -1;
}

KernelTables Exitance::tables_for(const Target& target) const noexcept {
  return target.darkness > kDark ? kernels_[0].exact_tables() : kernels_[0].tables();
}

const KernelSet& Exitance::set_for(const Target& target) const noexcept {
  return dark_set_ && target.darkness > kDark ? *dark_set_ : *set_;
}

void Exitance::eval_point(const Target& target, const Point& point, Room& room) const {
  const Vec3& x = room.points[point.index];
  Rgb* const values = &room.exitance[point.index * material_count_];
  room.evaluations += kernel_count_ * room.list.size();
  if (!set_) {
    const Float4 far = target.far.eval(x - target.centre);
    std::array<double, 3> sum{double{far[0]}, double{far[1]}, double{far[2]}};
    lanes::add_sources(tables_for(target), room.list, x, sum);
    for (std::size_t k = 0; k < 3; ++k)
      (*values)[static_cast<int>(k)] = static_cast<float>(std::max(sum[k], 0.0));
    return;
  }
  room.far.resize(set_->width());
  target.set_far.eval(x - target.centre, room.far);
  room.totals.assign(room.far.begin(), room.far.end());
  lanes::add_sources(set_for(target), room.list, x, room.totals);
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t first = set_->first(k), last = set_->first(k + 1);
    const auto channel = static_cast<int>(k);
    if (weights_.empty()) {
      for (std::size_t m = 0; m < material_count_; ++m)
        values[m][channel] = static_cast<float>(std::max(room.totals[first + m], 0.0));
      continue;
    }
    room.combined.assign(material_count_, 0.0f);
    for (std::size_t lane = first; lane < last; ++lane)
      for (std::size_t m = 0; m < material_count_; ++m)
        room.combined[m] += weights_[lane * material_count_ + m] * static_cast<float>(room.totals[lane]);
    for (std::size_t m = 0; m < material_count_; ++m) values[m][channel] = std::max(room.combined[m], 0.0f);
  }
}

// Far away from all samples, where no surface is.
void Exitance::eval_outside(const Point& point, Room& room) const {
  if (powers_.size() == 0)
    return sum_exactly(room.points.subspan(point.index, 1),
                       room.exitance.subspan(point.index * material_count_, material_count_),
                       room.evaluations);
  Target& target = room.targets[0];
  target.centre = room.points[point.index];
  target.darkness = kDarkest;
  target.set_far.clear(set_->width());
  room.list.clear();
  for (std::size_t i = 0; i < source_count_; ++i) room.list.add(sources_[i]);
  room.list.pad();
  room.list.copy_rows(source_powers(), row_width_);
  eval_point(target, point, room);
}

// Sums up for the points of one block or cell, which follow each other.
void Exitance::eval_target(std::span<const Point> range, int level, const Target* parent, Room& room) const {
  Target& target = room.targets[static_cast<std::size_t>(level)];
  place(target, range, level, room);
  if (!set_)
    target.far = parent ? parent->far.moved(target.centre - parent->centre) : LocalExpansion{};
  else if (parent)
    target.set_far.move_from(parent->set_far, target.centre - parent->centre);
  else
    target.set_far.clear(set_->width());
  target.pending.clear();
  const double side = cell_size_ * static_cast<double>(1 << level) / spacing_;
  const double work = static_cast<double>(range.size()) * std::max(1.0, std::sqrt(side / kSpacingsPerCell));
  const bool is_leaf =
      level == 0 || (room.whole ? level <= kWholeLevel && work <= kPointsPerCell : level <= kLeafLevel);

  // The sum hardly changes within a cell of a few samples.
  const bool inherits = room.whole && level <= kInheritLevel;
  target.total = inherits ? parent->total : weigh(target, room);
  target.darkness = inherits ? parent->darkness : find_darkness(target.total);
  make_limits(target, room);

  const bool certified = promise_ == Promise::kCertified;
  const float weight = certified ? 1 : kMomentWeight;
  SortedNodes& nodes = room.nodes;
  const NodeTest test{.nodes = nodes_.data(),
                      .centre = target.centre,
                      .radius = target.radius,
                      .open_small = is_leaf,
                      .certified = certified,
                      .ratio = certified ? static_cast<float>(kCertifiedRatio) : kRatio,
                      .reach = weight * target.radius,
                      .third = weight / 3,
                      .bins = bins_,
                      .limits = room.limits.data()};
  nodes.far.clear();
  nodes.points.clear();
  nodes.samples.clear();
  nodes.far_samples.clear();
  room.list.clear();
  nodes.work.clear();
  if (parent)
    nodes.work.append(parent->pending.span());
  else
    nodes.work.push(0);
  while (nodes.work.size() > 0) {
    nodes.scattered.clear();
    nodes.opened.clear();
    nodes.pending.clear();
    lanes::sort_nodes(test, nodes);
    nodes.work.clear();
    for (const std::uint32_t index : nodes.scattered.span()) {
      const SumNode& node = nodes_[index];
      const bool has_children = node.child_count() > 0;
      (has_children ? nodes.work : nodes.far_samples)
          .push_run(node.first, has_children ? node.child_count() : node.sample_count());
    }
    for (const std::uint32_t index : nodes.opened.span()) {
      const SumNode& node = nodes_[index];
      if (node.child_count() > 0)
        nodes.work.push_run(node.first, node.child_count());
      else if (is_leaf)
        nodes.samples.push_run(node.first, node.sample_count());
      else
        target.pending.push(index);
    }
    target.pending.append(nodes.pending.span());
  }
  if (is_leaf) lanes::sort_samples(test, sources_.data(), nodes, room.list);
  const auto far = nodes.far.span(), far_samples = nodes.far_samples.span();
  if (set_) {
    const KernelSet& set = set_for(target);
    lanes::add_series(set, nodes_.data(), node_powers(), far, target.centre, target.set_far);
    lanes::add_series(set, sources_.data(), source_powers(), far_samples, target.centre, target.set_far);
  } else {
    const KernelTables tables = tables_for(target);
    lanes::add_series(tables, nodes_.data(), far, target.centre, target.far);
    lanes::add_series(tables, sources_.data(), far_samples, target.centre, target.far);
  }
  room.evaluations += kernel_count_ * (nodes.far.size() + nodes.far_samples.size());

  if (is_leaf) {
    for (const std::uint32_t index : nodes.points.span()) {
      const SumNode& node = nodes_[index];
      const auto row = static_cast<std::uint32_t>(source_count_) + index;
      room.list.add({node.x, node.y, node.z, 0, node_powers() ? with_row(node.power, row) : node.power});
    }
    room.list.pad();
    if (source_powers()) room.list.copy_rows(source_powers(), row_width_);
    for (const Point& point : range) eval_point(target, point, room);
    return;
  }
  target.pending.append(nodes.points.span());
  const int shift = 3 * (level - 1);
  for (std::size_t begin = 0; begin < range.size();) {
    std::size_t end = begin + 1;
    while (end < range.size() && range[end].code >> shift == range[begin].code >> shift) ++end;
    eval_target(range.subspan(begin, end - begin), level - 1, &target, room);
    begin = end;
  }
}

void Exitance::eval(std::span<const Vec3> points, std::span<Rgb> exitance, std::uint64_t& evaluations) const {
  eval_points(points, exitance, evaluations, false);
}

void Exitance::eval_whole(std::span<const Vec3> points, std::span<Rgb> exitance,
                          std::uint64_t& evaluations) const {
  eval_points(points, exitance, evaluations, true);
}

void Exitance::eval_points(std::span<const Vec3> points, std::span<Rgb> exitance, std::uint64_t& evaluations,
                           bool whole) const {
  if (nodes_.empty()) return eval_exact(points, exitance, evaluations);
  const std::vector<Vec3> places = scaled(points);
  std::vector<Point> order;
  order.reserve(points.size());
  Room room{places, exitance, whole, {}, {}, {}, {}, {}, {}, {}, 0};
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    if (in_grid(points[i]))
      order.push_back({cell_code(points[i]), i});
    else
      eval_outside({0, i}, room);
  }
  std::ranges::sort(order, [](const Point& a, const Point& b) {
    return a.code != b.code ? a.code < b.code : a.index < b.index;
  });
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = begin + 1;
    while (end < order.size() && order[end].code >> 3 * kBlockLevels == order[begin].code >> 3 * kBlockLevels)
      ++end;
    eval_target(std::span(order).subspan(begin, end - begin), kBlockLevels, nullptr, room);
    begin = end;
  }
  evaluations += room.evaluations;
}

std::vector<Vec3> Exitance::scaled(std::span<const Vec3> points) const {
  std::vector<Vec3> result(points.begin(), points.end());
  for (Vec3& point : result) point *= unit_;
  return result;
}

void Exitance::eval_exact(std::span<const Vec3> points, std::span<Rgb> exitance,
                          std::uint64_t& evaluations) const {
  sum_exactly(scaled(points), exitance, evaluations);
}

void Exitance::sum_exactly(std::span<const Vec3> points, std::span<Rgb> exitance,
                           std::uint64_t& evaluations) const {
  constexpr std::size_t kChunk = 4096;
  std::vector<std::array<double, 3>> totals(exitance.size());
  SourceList list;
  for (std::size_t begin = 0; begin < group_.size(); begin += kChunk) {
    list.clear();
    for (std::size_t i = begin; i < std::min(begin + kChunk, group_.size()); ++i) list.add(make_source(i));
    list.pad();
    for (std::size_t i = 0; i < exitance.size(); ++i)
      lanes::add_sources(kernels_[i % material_count_].exact_tables(), list, points[i / material_count_],
                         totals[i]);
  }
  for (std::size_t i = 0; i < exitance.size(); ++i)
    for (int k = 0; k < 3; ++k) exitance[i][k] = static_cast<float>(totals[i][static_cast<std::size_t>(k)]);
  evaluations += exitance.size() * group_.size();
}

}  // namespace nacre
