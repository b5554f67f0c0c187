// The same loops for every vector instruction set, chosen at run time.
#include "cache/sum_lanes.h"

#include <algorithm>

#define HWY_COMPILE_ALL_ATTAINABLE  // the plain one, too
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cache/sum_lanes.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace nacre::lanes::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using F = hn::ScalableTag<float>;
using I = hn::RebindToSigned<F>;
using U = hn::RebindToUnsigned<F>;
using VF = hn::Vec<F>;
using VI = hn::Vec<I>;

// Where a distance lies in a table: the cell times `stride`, and the fraction of it.
HWY_INLINE VI find_cell(const DistanceBins& bins, VF r2) {
  const I di;
  const VI cell = hn::ShiftRightSame(hn::BitCast(di, r2), bins.shift);
  return hn::Sub(hn::Min(hn::Max(cell, hn::Set(di, bins.first)), hn::Set(di, bins.last)),
                 hn::Set(di, bins.first));
}
HWY_INLINE VF find_fraction(const DistanceBins& bins, VF r2) {
  const F df;
  const I di;
  const std::int32_t mask = (1 << bins.shift) - 1;
  return hn::Mul(hn::ConvertTo(df, hn::And(hn::BitCast(di, r2), hn::Set(di, mask))),
                 hn::Set(df, 1.0f / static_cast<float>(1 << bins.shift)));
}

// Rows of a table at squared distances: fields of a row are 4 floats, one for each channel, followed by their
// differences to the next row if the table is interpolated.
template <bool kInterpolated, int kFieldsLog2>
struct Rows {
  const float* table;
  VI offset;
  VF fraction;

  HWY_INLINE Rows(const float* first, const DistanceBins& bins, VF r2)
      : table(first), offset(hn::ShiftLeft<2 + kFieldsLog2 + kInterpolated>(find_cell(bins, r2))) {
    if constexpr (kInterpolated) fraction = find_fraction(bins, r2);
  }
  HWY_INLINE VF operator()(int field, int channel) const {
    const F df;
    const float* const at = table + (kInterpolated ? 8 : 4) * field + channel;
    const VF value = hn::GatherIndex(df, at, offset);
    if constexpr (kInterpolated) return hn::MulAdd(fraction, hn::GatherIndex(df, at + 4, offset), value);
    return value;
  }
};

HWY_INLINE VF length2(VF x, VF y, VF z) { return hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z))); }

// The squared distance at which a singular kernel has its average over a sample's disc.
HWY_INLINE VF disc_distance2(const KernelTables& kernel, VF r2, VF area) {
  const F df;
  const I di;
  const VF radius2 = hn::Mul(area, hn::Set(df, 1 / kPi));
  const auto inside = hn::Lt(r2, hn::Mul(radius2, hn::Set(df, square(kernel.disc_reach))));
  if (hn::AllFalse(df, inside)) return r2;
  const VF radius = hn::Sqrt(radius2);
  const VF t = hn::IfThenElseZero(
      inside, hn::Mul(hn::Div(hn::Sqrt(r2), radius), hn::Set(df, kernel.discs_per_radius)));
  const VI cell =
      hn::Min(hn::ConvertTo(di, t),
              hn::Set(di, static_cast<std::int32_t>(kernel.discs_per_radius * kernel.disc_reach) - 1));
  const VF low = hn::GatherIndex(df, kernel.discs, cell), high = hn::GatherIndex(df, kernel.discs + 1, cell);
  const VF effective =
      hn::Div(radius, hn::MulAdd(hn::Sub(t, hn::ConvertTo(df, cell)), hn::Sub(high, low), low));
  return hn::IfThenElse(inside, hn::Mul(effective, effective), r2);
}

template <bool kInterpolated>
HWY_INLINE void add_list(const KernelTables& kernel, const SourceList& list, const Vec3& x,
                         std::array<double, 3>& total) {
  const F df;
  // Runs of a few terms are kept by floats; the whole is added up in double precision.
  constexpr std::size_t kRun = 64;
  const std::size_t lanes = hn::Lanes(df), count = (list.size() + lanes - 1) / lanes * lanes;
  const VF cx = hn::Set(df, x.x), cy = hn::Set(df, x.y), cz = hn::Set(df, x.z);
  for (std::size_t begin = 0; begin < count; begin += kRun * lanes) {
    VF r = hn::Zero(df), g = r, b = r;
    for (std::size_t i = begin, end = std::min(count, begin + kRun * lanes); i < end; i += lanes) {
      const auto load = [&](SourceList::Field f) HWY_ATTR { return hn::LoadU(df, list.field(f) + i); };
      VF r2 = length2(hn::Sub(load(SourceList::kX), cx), hn::Sub(load(SourceList::kY), cy),
                      hn::Sub(load(SourceList::kZ), cz));
      if (kernel.singular) r2 = disc_distance2(kernel, r2, load(SourceList::kArea));
      const Rows<kInterpolated, 0> row(kernel.cells, kernel.cell_bins, r2);
      r = hn::MulAdd(row(0, 0), load(SourceList::kR), r);
      g = hn::MulAdd(row(0, 1), load(SourceList::kG), g);
      b = hn::MulAdd(row(0, 2), load(SourceList::kB), b);
    }
    total[0] += static_cast<double>(hn::GetLane(hn::SumOfLanes(df, r)));
    total[1] += static_cast<double>(hn::GetLane(hn::SumOfLanes(df, g)));
    total[2] += static_cast<double>(hn::GetLane(hn::SumOfLanes(df, b)));
  }
}

void add_sources(const KernelTables& kernel, const SourceList& list, const Vec3& x,
                 std::array<double, 3>& total) {
  if (kernel.interpolated)
    add_list<true>(kernel, list, x, total);
  else
    add_list<false>(kernel, list, x, total);
}

// A vector of indices, the last one repeated, and which of them are new.
struct Batch {
  hn::Vec<U> index;
  hn::Mask<F> valid;
};
HWY_INLINE Batch load_batch(const std::uint32_t* indices, std::size_t i, std::size_t count) {
  const F df;
  const U du;
  const std::size_t lanes = hn::Lanes(df);
  if (i + lanes <= count) return {hn::LoadU(du, indices + i), hn::FirstN(df, lanes)};
  HWY_ALIGN std::uint32_t rest[HWY_MAX_BYTES / 4];
  for (std::size_t k = 0; k < lanes; ++k) rest[k] = indices[std::min(i + k, count - 1)];
  return {hn::Load(du, rest), hn::FirstN(df, count - i)};
}

// Gathers one field of structures of floats at a time.
struct Fields {
  const float* first;
  VI offset;
  HWY_INLINE VF operator()(int field) const { return hn::GatherIndex(F(), first + field, offset); }
};
template <class Struct>
HWY_INLINE Fields gather(const Struct* structs, hn::Vec<U> index) {
  const I di;
  return {reinterpret_cast<const float*>(structs),
          hn::Mul(hn::BitCast(di, index),
                  hn::Set(di, static_cast<std::int32_t>(sizeof(Struct) / sizeof(float))))};
}
// The fields of a SumNode, float by float.
enum NodeField { kNodeX, kNodeY, kNodeZ, kNodeRadius, kNodeSpread, kNodeLean, kNodeOpening, kNodePower };
// And of a SumSource.
enum SourceField { kSourceX, kSourceY, kSourceZ, kSourceArea, kSourcePower };

HWY_INLINE void append(IndexList& list, std::uint32_t* room, hn::Vec<U> index, hn::Mask<F> mask) {
  const U du;
  list.grow(hn::CompressStore(index, hn::RebindMask(du, mask), du, room));
}

void sort_nodes(const NodeTest& test, SortedNodes& lists) {
  const F df;
  const std::size_t lanes = hn::Lanes(df), count = lists.work.size();
  const VF cx = hn::Set(df, test.centre.x), cy = hn::Set(df, test.centre.y), cz = hn::Set(df, test.centre.z);
  for (std::size_t i = 0; i < count; i += lanes) {
    const Batch batch = load_batch(lists.work.data(), i, count);
    const Fields node = gather(test.nodes, batch.index);
    const VF r2 = length2(hn::Sub(node(kNodeX), cx), hn::Sub(node(kNodeY), cy), hn::Sub(node(kNodeZ), cz));
    const VF radius = node(kNodeRadius), spread = node(kNodeSpread);
    // From the point of the target that is nearest to the node.
    const VF to_centre = hn::Sub(hn::Sqrt(r2), hn::Set(df, test.radius));
    const VF to_rim = hn::Sub(to_centre, radius);
    const VF near = test.certified ? to_rim : to_centre;
    const VI bin = find_cell(test.bins, hn::Mul(near, near));
    const VF error = hn::MulAdd(node(kNodeLean), hn::GatherIndex(df, test.lean, bin), spread);
    const auto lit = hn::And(batch.valid, hn::Ge(spread, hn::Zero(df)));
    auto apart = hn::And(lit, hn::Gt(to_rim, hn::Set(df, test.nearest)));
    if (test.certified) apart = hn::And(apart, hn::Le(radius, hn::Mul(hn::Set(df, test.ratio), to_rim)));
    const auto far = hn::And(apart, hn::Le(error, hn::GatherIndex(df, test.in_series, bin)));
    const auto point =
        hn::AndNot(far, hn::And(apart, hn::Le(error, hn::GatherIndex(df, test.as_point, bin))));
    const auto rest = hn::AndNot(far, hn::AndNot(point, lit));
    const VI rim_bin = find_cell(test.bins, hn::Mul(to_rim, to_rim));
    const auto scattered = hn::And(hn::And(rest, hn::Gt(to_rim, hn::Set(df, test.nearest))),
                                   hn::Ge(hn::GatherIndex(df, test.in_series, rim_bin), hn::Zero(df)));
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
  for (std::size_t i = 0; i < count; i += lanes) {
    const Batch batch = load_batch(lists.samples.data(), i, count);
    const Fields source = gather(sources, batch.index);
    const VF x = source(kSourceX), y = source(kSourceY), z = source(kSourceZ);
    const VF r = hn::Sqrt(length2(hn::Sub(x, cx), hn::Sub(y, cy), hn::Sub(z, cz)));
    const VF to_sample = hn::Sub(r, hn::Set(df, test.radius));
    const VI bin = find_cell(test.bins, hn::Mul(to_sample, to_sample));
    const auto far = hn::And(hn::And(batch.valid, hn::Gt(to_sample, hn::Set(df, test.nearest))),
                             hn::Ge(hn::GatherIndex(df, test.in_series, bin), hn::Zero(df)));
    append(lists.far_samples, lists.far_samples.room(lanes), batch.index, far);
    near.reserve(lanes);
    const auto here = hn::AndNot(far, batch.valid);
    const VF values[] = {x,
                         y,
                         z,
                         source(kSourceArea),
                         source(kSourcePower),
                         source(kSourcePower + 1),
                         source(kSourcePower + 2)};
    for (int f = 0; f < SourceList::kFieldCount; ++f)
      hn::CompressStore(values[f], here, df, near.end(static_cast<SourceList::Field>(f)));
    near.grow(hn::CountTrue(df, here));
  }
}

template <bool kInterpolated, int kPower, class Struct>
HWY_INLINE void add_structs(const KernelTables& kernel, const Struct* structs,
                            std::span<const std::uint32_t> far, const Vec3& centre,
                            LocalExpansion& expansion) {
  const F df;
  const std::size_t lanes = hn::Lanes(df);
  const VF cx = hn::Set(df, centre.x), cy = hn::Set(df, centre.y), cz = hn::Set(df, centre.z);
  VF sums[3][10];
  for (auto& channel : sums)
    for (VF& sum : channel) sum = hn::Zero(df);
  for (std::size_t i = 0; i < far.size(); i += lanes) {
    const Batch batch = load_batch(far.data(), i, far.size());
    const Fields source = gather(structs, batch.index);
    const VF x = hn::Sub(cx, source(0)), y = hn::Sub(cy, source(1)), z = hn::Sub(cz, source(2));
    const VF r2 = length2(x, y, z);
    const Rows<kInterpolated, 0> row(kernel.cells, kernel.cell_bins, r2);
    const Rows<kInterpolated, 1> jet(kernel.jets, kernel.jet_bins, r2);
    for (int k = 0; k < 3; ++k) {
      const VF power = hn::IfThenElseZero(batch.valid, source(kPower + k));
      const VF value = row(0, k);
      const VF radial = hn::Mul(power, jet(0, k));
      const VF bend = hn::Mul(power, jet(1, k));
      VF(&s)[10] = sums[k];
      s[0] = hn::MulAdd(power, value, s[0]);
      s[1] = hn::MulAdd(radial, x, s[1]);
      s[2] = hn::MulAdd(radial, y, s[2]);
      s[3] = hn::MulAdd(radial, z, s[3]);
      const VF bend_x = hn::Mul(bend, x), bend_y = hn::Mul(bend, y), bend_z = hn::Mul(bend, z);
      s[4] = hn::Add(hn::MulAdd(bend_x, x, radial), s[4]);
      s[5] = hn::Add(hn::MulAdd(bend_y, y, radial), s[5]);
      s[6] = hn::Add(hn::MulAdd(bend_z, z, radial), s[6]);
      s[7] = hn::MulAdd(bend_y, z, s[7]);
      s[8] = hn::MulAdd(bend_z, x, s[8]);
      s[9] = hn::MulAdd(bend_x, y, s[9]);
    }
  }
  for (int k = 0; k < 3; ++k) {
    const auto sum = [&](int i) HWY_ATTR { return hn::GetLane(hn::SumOfLanes(df, sums[k][i])); };
    expansion.value[k] += sum(0);
    for (int i = 0; i < 3; ++i) expansion.gradient[static_cast<std::size_t>(i)][k] += sum(1 + i);
    for (int i = 0; i < 6; ++i) expansion.hessian[static_cast<std::size_t>(i)][k] += sum(4 + i);
  }
}

void add_node_series(const KernelTables& kernel, const SumNode* nodes, std::span<const std::uint32_t> far,
                     const Vec3& centre, LocalExpansion& expansion) {
  if (kernel.interpolated)
    add_structs<true, kNodePower>(kernel, nodes, far, centre, expansion);
  else
    add_structs<false, kNodePower>(kernel, nodes, far, centre, expansion);
}
void add_sample_series(const KernelTables& kernel, const SumSource* sources,
                       std::span<const std::uint32_t> far, const Vec3& centre, LocalExpansion& expansion) {
  if (kernel.interpolated)
    add_structs<true, kSourcePower>(kernel, sources, far, centre, expansion);
  else
    add_structs<false, kSourcePower>(kernel, sources, far, centre, expansion);
}

template <bool kInterpolated>
HWY_INLINE std::uint64_t add_nodes(const KernelTables& kernel, const CoarseTest& test, SortedNodes& lists,
                                   Float4& total) {
  const F df;
  const std::size_t lanes = hn::Lanes(df), count = lists.work.size();
  const VF cx = hn::Set(df, test.centre.x), cy = hn::Set(df, test.centre.y), cz = hn::Set(df, test.centre.z);
  VF sums[3] = {hn::Zero(df), hn::Zero(df), hn::Zero(df)};
  std::uint64_t added = 0;
  for (std::size_t i = 0; i < count; i += lanes) {
    const Batch batch = load_batch(lists.work.data(), i, count);
    const Fields node = gather(test.nodes, batch.index);
    const VF radius = node(kNodeRadius);
    const VF r =
        hn::Sqrt(length2(hn::Sub(node(kNodeX), cx), hn::Sub(node(kNodeY), cy), hn::Sub(node(kNodeZ), cz)));
    const auto open = hn::And(batch.valid, hn::Gt(node(kNodeOpening), hn::Mul(hn::Set(df, test.ratio), r)));
    append(lists.opened, lists.opened.room(lanes), batch.index, open);
    const auto taken = hn::AndNot(open, batch.valid);
    added += hn::CountTrue(df, taken);
    const VF distance = test.certified ? hn::Add(hn::Add(r, radius), hn::Set(df, test.slack))
                                       : hn::Max(hn::Max(r, radius), hn::Set(df, test.slack));
    const VF r2 = hn::Mul(distance, distance);
    const Rows<kInterpolated, 0> row(kernel.cells, kernel.cell_bins, r2);
    for (int k = 0; k < 3; ++k)
      sums[k] = hn::MulAdd(hn::IfThenElseZero(taken, node(kNodePower + k)), row(0, k), sums[k]);
  }
  for (int k = 0; k < 3; ++k) total[k] += hn::GetLane(hn::SumOfLanes(df, sums[k]));
  return added;
}

std::uint64_t add_coarsely(const KernelTables& kernel, const CoarseTest& test, SortedNodes& lists,
                           Float4& total) {
  return kernel.interpolated ? add_nodes<true>(kernel, test, lists, total)
                             : add_nodes<false>(kernel, test, lists, total);
}

void least_of_channels(const std::array<const float*, 3>& a, const std::array<const float*, 3>& b,
                       const Rgb& share, std::size_t count, float* out) {
  const F df;
  for (std::size_t i = 0; i < count; i += hn::Lanes(df)) {
    VF least = hn::Set(df, 3e38f);
    for (std::size_t k = 0; k < 3; ++k)
      least = hn::Min(least, hn::MulAdd(hn::Set(df, share[static_cast<int>(k)]), hn::LoadU(df, b[k] + i),
                                        hn::LoadU(df, a[k] + i)));
    hn::StoreU(least, df, out + i);
  }
}

}  // namespace nacre::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nacre {

// Floats in the longest vector of any target.
constexpr std::size_t kLongest = 64;

void SourceList::reserve(std::size_t count) {
  if (fields_[0].size() < size_ + count + kLongest)
    for (auto& field : fields_) field.resize(2 * (size_ + count + kLongest));
}

void SourceList::add(std::span<const SumSource> sources) {
  reserve(sources.size());
  for (const SumSource& s : sources) {
    const std::array<float, kFieldCount> values{s.x, s.y, s.z, s.area, s.power[0], s.power[1], s.power[2]};
    for (std::size_t f = 0; f < kFieldCount; ++f) fields_[f][size_] = values[f];
    ++size_;
  }
}

void SourceList::pad() {
  if (size_ == 0) return;
  for (std::size_t i = 0; i < kLongest; ++i)
    for (std::size_t f = 0; f < kFieldCount; ++f)
      fields_[f][size_ + i] = f < kR ? fields_[f][size_ - 1] : 0.0f;
}

namespace lanes {

HWY_EXPORT(add_sources);
HWY_EXPORT(sort_nodes);
HWY_EXPORT(sort_samples);
HWY_EXPORT(add_node_series);
HWY_EXPORT(add_sample_series);
HWY_EXPORT(add_coarsely);
HWY_EXPORT(least_of_channels);

void add_sources(const KernelTables& kernel, const SourceList& list, const Vec3& x,
                 std::array<double, 3>& total) {
  HWY_DYNAMIC_DISPATCH(add_sources)(kernel, list, x, total);
}
void sort_nodes(const NodeTest& test, SortedNodes& lists) { HWY_DYNAMIC_DISPATCH(sort_nodes)(test, lists); }
void add_series(const KernelTables& kernel, const SumNode* nodes, std::span<const std::uint32_t> far,
                const Vec3& centre, LocalExpansion& expansion) {
  HWY_DYNAMIC_DISPATCH(add_node_series)(kernel, nodes, far, centre, expansion);
}
void add_series(const KernelTables& kernel, const SumSource* sources, std::span<const std::uint32_t> far,
                const Vec3& centre, LocalExpansion& expansion) {
  HWY_DYNAMIC_DISPATCH(add_sample_series)(kernel, sources, far, centre, expansion);
}
void sort_samples(const NodeTest& test, const SumSource* sources, SortedNodes& lists, SourceList& near) {
  HWY_DYNAMIC_DISPATCH(sort_samples)(test, sources, lists, near);
}
std::uint64_t add_coarsely(const KernelTables& kernel, const CoarseTest& test, SortedNodes& lists,
                           Float4& total) {
  return HWY_DYNAMIC_DISPATCH(add_coarsely)(kernel, test, lists, total);
}
void least_of_channels(const std::array<const float*, 3>& a, const std::array<const float*, 3>& b,
                       const Rgb& share, std::size_t count, float* out) {
  HWY_DYNAMIC_DISPATCH(least_of_channels)(a, b, share, count, out);
}

}  // namespace lanes
}  // namespace nacre
#endif
