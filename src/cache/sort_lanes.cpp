// Which nodes and samples go where, for every vector instruction set, chosen at run time.
#include <algorithm>

#include "cache/sum_lanes.h"

#define HWY_COMPILE_ALL_ATTAINABLE  // the plain one, too
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cache/sort_lanes.cpp"
#include <hwy/foreach_target.h>

#include "cache/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace nacre::lanes::HWY_NAMESPACE {

// Nodes that are fetched before they are at hand: they lie all over a memory that is larger than near caches.
constexpr std::size_t kAhead = 16;

void sort_nodes(const NodeTest& test, SortedNodes& lists) {
  const F df;
  const std::size_t lanes = hn::Lanes(df), count = lists.work.size();
  const VF cx = hn::Set(df, test.centre.x), cy = hn::Set(df, test.centre.y), cz = hn::Set(df, test.centre.z);
  lists.work.pad();
  for (std::size_t i = 0; i < count; i += lanes) {
    const Batch batch = load_batch(lists.work, i);
    for (std::size_t k = 0; k < lanes; ++k) {
      const SumNode& ahead = test.nodes[batch.indices[kAhead + k]];
      __builtin_prefetch(&ahead);
      __builtin_prefetch(&ahead.tint);
    }
    const auto [x, y, z, radius] = load_fields(test.nodes, batch.indices, kNodeX);
    const auto [spread, lean, first, counts] = load_fields(test.nodes, batch.indices, kNodeSpread);
    const VF tint = load_fields(test.nodes, batch.indices, kNodeZX).c;
    const VF r2 = length2(hn::Sub(x, cx), hn::Sub(y, cy), hn::Sub(z, cz));
    // From the point of the target that is nearest to the node.
    const VF to_centre = hn::Sub(hn::Sqrt(r2), hn::Set(df, test.radius));
    const VF to_rim = hn::Sub(to_centre, radius);
    const VF near = test.certified ? to_rim : to_centre;
    HWY_ALIGN std::uint32_t bins[hn::MaxLanes(df)];
    store_cells(test.bins, hn::Mul(near, near), bins);
    const auto [to_lean, to_bend, as_point, in_series] = load_fields(test.limits, bins, kLean);
    // In a series, as a point.
    const VF moments = hn::MulAdd(hn::Set(df, test.third), radius, hn::Set(df, test.reach));
    const VF series_error = hn::MulAdd(spread, moments, hn::MulAdd(lean, to_lean, hn::Mul(tint, to_bend)));
    const VF point_error = hn::MulAdd(spread, to_bend, hn::Mul(lean, to_lean));
    const auto lit = hn::And(batch.valid, hn::Ge(spread, hn::Zero(df)));
    auto apart = hn::And(lit, hn::Gt(to_rim, hn::Zero(df)));
    apart = hn::And(apart, hn::Le(radius, hn::Mul(hn::Set(df, test.ratio), to_rim)));
    const auto far = hn::And(apart, hn::Le(series_error, in_series));
    const auto point = hn::AndNot(far, hn::And(apart, hn::Le(point_error, as_point)));
    const auto rest = hn::AndNot(far, hn::AndNot(point, lit));
    store_cells(test.bins, hn::Mul(to_rim, to_rim), bins);
    const auto scattered = hn::And(hn::And(rest, hn::Gt(to_rim, hn::Zero(df))),
                                   hn::Ge(load_fields(test.limits, bins, kLean).d, hn::Zero(df)));
    const auto near_rest = hn::AndNot(scattered, rest);
    const auto opened =
        test.open_small ? near_rest : hn::And(near_rest, hn::Gt(radius, hn::Set(df, test.radius)));
    append(lists.scattered, lists.scattered.room(lanes), batch.index, scattered);
    append(lists.far, lists.far.room(lanes), batch.index, far);
    append(lists.points, lists.points.room(lanes), batch.index, point);
    append(lists.opened, lists.opened.room(lanes), batch.index, opened);
    if (!test.open_small)
      append(lists.pending, lists.pending.room(lanes), batch.index, hn::AndNot(opened, near_rest));
  }
}

void sort_samples(const NodeTest& test, const SumSource* sources, SortedNodes& lists, SourceList& near) {
  const F df;
  const std::size_t lanes = hn::Lanes(df), count = lists.samples.size();
  const VF cx = hn::Set(df, test.centre.x), cy = hn::Set(df, test.centre.y), cz = hn::Set(df, test.centre.z);
  lists.samples.pad();
  for (std::size_t i = 0; i < count; i += lanes) {
    const Batch batch = load_batch(lists.samples, i);
    const auto [x, y, z, spare] = load_fields(sources, batch.indices, kSourceX);
    const VF r = hn::Sqrt(length2(hn::Sub(x, cx), hn::Sub(y, cy), hn::Sub(z, cz)));
    const VF to_sample = hn::Sub(r, hn::Set(df, test.radius));
    HWY_ALIGN std::uint32_t bins[hn::MaxLanes(df)];
    store_cells(test.bins, hn::Mul(to_sample, to_sample), bins);
    const auto far = hn::And(hn::And(batch.valid, hn::Gt(to_sample, hn::Zero(df))),
                             hn::Ge(load_fields(test.limits, bins, kLean).d, hn::Zero(df)));
    append(lists.far_samples, lists.far_samples.room(lanes), batch.index, far);
    near.reserve(lanes);
    const auto here = hn::AndNot(far, batch.valid);
    const VF values[] = {x, y, z};
    for (int f = 0; f < SourceList::kFieldCount; ++f)
      store_lanes(values[f], here, df, near.field(static_cast<SourceList::Field>(f)) + near.size());
    HWY_ALIGN std::uint32_t which[hn::MaxLanes(df)];
    const std::size_t taken = store_lanes(batch.index, here, U(), which);
    for (std::size_t k = 0; k < taken; ++k) near.powers()[near.size() + k] = sources[which[k]].power;
    near.grow(taken);
  }
}

void make_limits(std::span<const LimitTerm> terms, const float* lean, const float* bend, float scale,
                 std::size_t count, Limits* limits) {
  const F df;
  const VF by = hn::Set(df, scale);
  for (std::size_t i = 0; i < count; i += hn::Lanes(df)) {
    VF point = hn::Set(df, 3e38f), series = point;
    for (const LimitTerm& term : terms) {
      const VF allowed = hn::Mul(hn::Set(df, term.share), hn::LoadU(df, term.per_share + i));
      point = hn::Min(point, hn::Add(allowed, hn::LoadU(df, term.as_point + i)));
      series = hn::Min(series, hn::Add(allowed, hn::LoadU(df, term.in_series + i)));
    }
    hn::StoreInterleaved4(hn::LoadU(df, lean + i), hn::LoadU(df, bend + i), hn::Mul(by, point),
                          hn::Mul(by, series), df, reinterpret_cast<float*>(limits + i));
  }
}

}  // namespace nacre::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nacre {

// Floats in the longest vector of any target.
constexpr std::size_t kLongest = 64;

void SourceList::reserve(std::size_t count) {
  if (powers_.size() >= size_ + count + kLongest) return;
  for (auto& field : fields_) field.resize(2 * (size_ + count + kLongest));
  powers_.resize(2 * (size_ + count + kLongest));
}

void SourceList::add(const SumSource& source) {
  reserve(1);
  const std::array<float, kFieldCount> values{source.x, source.y, source.z};
  for (std::size_t f = 0; f < kFieldCount; ++f) fields_[f][size_] = values[f];
  powers_[size_] = source.power;
  ++size_;
}

void SourceList::copy_rows(const float* rows, std::size_t width) {
  rows_.resize(std::max(rows_.size(), size_ * width));
  constexpr std::size_t kAhead = 16;  // within what `pad` adds
  Float4* to = reinterpret_cast<Float4*>(rows_.data());
  for (std::size_t i = 0; i < size_; ++i) {
    __builtin_prefetch(rows + power_row(powers_[i + kAhead]) * width);
    const Float4* const from = reinterpret_cast<const Float4*>(rows + power_row(powers_[i]) * width);
#pragma GCC unroll 4
    for (std::size_t c = 0; c < width / 4; ++c) *to++ = from[c];
  }
}

void SourceList::pad() {
  if (size_ == 0) return;
  reserve(0);
  for (std::size_t i = 0; i < kLongest; ++i) {
    for (auto& field : fields_) field[size_ + i] = field[size_ - 1];
    powers_[size_ + i] = broadcast(0);
  }
}

namespace lanes {

HWY_EXPORT(sort_nodes);
HWY_EXPORT(sort_samples);
HWY_EXPORT(make_limits);

void sort_nodes(const NodeTest& test, SortedNodes& lists) { HWY_DYNAMIC_DISPATCH(sort_nodes)(test, lists); }
void sort_samples(const NodeTest& test, const SumSource* sources, SortedNodes& lists, SourceList& near) {
  HWY_DYNAMIC_DISPATCH(sort_samples)(test, sources, lists, near);
}
void make_limits(std::span<const LimitTerm> terms, const float* lean, const float* bend, float scale,
                 std::size_t count, Limits* limits) {
  HWY_DYNAMIC_DISPATCH(make_limits)(terms, lean, bend, scale, count, limits);
}

}  // namespace lanes
}  // namespace nacre
#endif
