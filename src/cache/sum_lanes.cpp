// Sums and series for every vector instruction set, chosen at run time.
#include "cache/sum_lanes.h"

#include <algorithm>
#include <type_traits>

#define HWY_COMPILE_ALL_ATTAINABLE  // the plain one, too
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cache/sum_lanes.cpp"
#include <hwy/foreach_target.h>

#include "cache/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace nacre::lanes::HWY_NAMESPACE {

// Rows of a table for a run of squared distances. A row has fields of three channels, each followed by its
// difference to the next row if the table is interpolated. Rows are read one by one: a gather takes as long
// for one float of each.
template <bool kInterpolated, int kFields, std::size_t kRun>
struct Rows : RunRows<kInterpolated, kRun> {
  using RunRows<kInterpolated, kRun>::row;
  using RunRows<kInterpolated, kRun>::fraction;
  const Float4* table;

  HWY_INLINE Rows(const float* first) : table(reinterpret_cast<const Float4*>(first)) {}
  // Those of i and what follows it.
  HWY_INLINE Quads operator()(std::size_t i, int field) const {
    constexpr int kStep = kInterpolated ? 2 : 1;
    const auto at = [&](std::size_t k) HWY_ATTR { return table + kStep * (kFields * row[i + k] + field); };
    if constexpr (kInterpolated) {
      return mul_add(spread_quads(fraction + i),
                     load_quads([&](std::size_t k) HWY_ATTR { return at(k) + 1; }), load_quads(at));
    } else {
      return load_quads(at);
    }
  }
};

template <bool kInterpolated>
HWY_INLINE void add_list(const KernelTables& kernel, const SourceList& list, const Vec3& x,
                         std::array<double, 3>& total) {
  const F df;
  // Runs of few terms are added up by floats, those in double precision.
  constexpr std::size_t kRun = 256, kSums = 4, kTerms = kSums * kQuads;
  const std::size_t lanes = hn::Lanes(df), step = std::max(lanes, kTerms),
                    count = (list.size() + step - 1) / step * step;
  const VF cx = hn::Set(df, x.x), cy = hn::Set(df, x.y), cz = hn::Set(df, x.z);
  Rows<kInterpolated, 1, kRun> rows(kernel.cells);
  for (std::size_t begin = 0; begin < count; begin += kRun) {
    const std::size_t size = std::min(kRun, count - begin);
    for (std::size_t i = 0; i < size; i += lanes) {
      const auto load = [&](SourceList::Field f)
                            HWY_ATTR { return hn::LoadU(df, list.field(f) + begin + i); };
      const VF r2 = length2(hn::Sub(load(SourceList::kX), cx), hn::Sub(load(SourceList::kY), cy),
                            hn::Sub(load(SourceList::kZ), cz));
      rows.find(i, kernel.cell_bins, r2);
    }
    Quads sums[kSums];
    for (Quads& s : sums) s = no_quads();
    const Float4* const power = list.powers() + begin;
    for (std::size_t i = 0; i < size; i += kTerms)
      for (std::size_t k = 0; k < kSums; ++k)
        sums[k] = mul_add(load_row(power + i + k * kQuads), rows(i + k * kQuads, 0), sums[k]);
    const Float4 all = sum(add(add(sums[0], sums[1]), add(sums[2], sums[3])));
    for (std::size_t k = 0; k < 3; ++k) total[k] += static_cast<double>(all[static_cast<int>(k)]);
  }
}

void add_sources(const KernelTables& kernel, const SourceList& list, const Vec3& x,
                 std::array<double, 3>& total) {
  with_truth(kernel.interpolated,
             [&](auto interpolated) HWY_ATTR { add_list<interpolated.value>(kernel, list, x, total); });
}

template <bool kInterpolated, class Struct>
HWY_INLINE void add_structs(const KernelTables& kernel, const Struct* structs,
                            std::span<const std::uint32_t> far, const Vec3& centre,
                            LocalExpansion& expansion) {
  const F df;
  constexpr std::size_t kRun = 128;
  HWY_ALIGN Float4 offsets[kRun];
  std::uint32_t indices[kRun + hn::MaxLanes(df)];
  // Second moments of nodes: their trace, and twice what they stretch along the offset.
  constexpr bool kMoments = std::is_same_v<Struct, SumNode>;
  HWY_ALIGN Float4 moments[kMoments ? kRun : 1];
  Rows<kInterpolated, 1, kRun> values(kernel.cells);
  Rows<kInterpolated, 2, kRun> jets(kernel.jets);
  for (std::size_t begin = 0; begin < far.size(); begin += kRun) {
    const std::size_t size = std::min(kRun, far.size() - begin), lanes = hn::Lanes(df);
    find_offsets(structs, far.subspan(begin, size), centre, indices, offsets);
    for (std::size_t i = 0; i < size; i += lanes) {
      VF x, y, z, rest;
      hn::LoadInterleaved4(df, reinterpret_cast<const float*>(offsets + i), x, y, z, rest);
      const VF r2 = length2(x, y, z);
      values.find(i, kernel.cell_bins, r2);
      jets.find(i, kernel.jet_bins, r2);
      if constexpr (kMoments) {
        const auto [trace, stretch] = find_moments(structs, indices + i, x, y, z);
        hn::StoreInterleaved4(trace, stretch, trace, stretch, df, reinterpret_cast<float*>(moments + i));
      }
    }
    // Each sum in a register of its own.
    const Quads none = no_quads();
    Quads value = none, trace = none, slope_x = none, slope_y = none, slope_z = none, xx = none, yy = none,
          zz = none, yz = none, zx = none, xy = none;
    for (std::size_t i = 0; i < size; i += kQuads) {
      const Quads power = first_quads(
          load_quads([&](std::size_t k) HWY_ATTR { return &structs[indices[i + k]].power; }), size - i);
      const Quads offset = load_row(offsets + i);
      const Quads x = spread<0>(offset), y = spread<1>(offset), z = spread<2>(offset);
      value = mul_add(power, values(i, 0), value);
      const Quads radial = mul(power, jets(i, 0)), bend = mul(power, jets(i, 1));
      if constexpr (kMoments) {
        const Quads moment = load_row(moments + i);
        value = mul_add(radial, spread<0>(moment), value);
        value = mul_add(bend, spread<1>(moment), value);
      }
      trace = add(trace, radial);
      slope_x = mul_add(radial, x, slope_x);
      slope_y = mul_add(radial, y, slope_y);
      slope_z = mul_add(radial, z, slope_z);
      const Quads bend_x = mul(bend, x), bend_y = mul(bend, y), bend_z = mul(bend, z);
      xx = mul_add(bend_x, x, xx);
      yy = mul_add(bend_y, y, yy);
      zz = mul_add(bend_z, z, zz);
      yz = mul_add(bend_y, z, yz);
      zx = mul_add(bend_z, x, zx);
      xy = mul_add(bend_x, y, xy);
    }
    expansion.value += sum(value);
    expansion.gradient[0] += sum(slope_x);
    expansion.gradient[1] += sum(slope_y);
    expansion.gradient[2] += sum(slope_z);
    expansion.hessian[0] += sum(add(xx, trace));
    expansion.hessian[1] += sum(add(yy, trace));
    expansion.hessian[2] += sum(add(zz, trace));
    expansion.hessian[3] += sum(yz);
    expansion.hessian[4] += sum(zx);
    expansion.hessian[5] += sum(xy);
  }
}

void add_node_series(const KernelTables& kernel, const SumNode* nodes, std::span<const std::uint32_t> far,
                     const Vec3& centre, LocalExpansion& expansion) {
  with_truth(kernel.interpolated, [&](auto interpolated) HWY_ATTR {
    add_structs<interpolated.value>(kernel, nodes, far, centre, expansion);
  });
}
void add_sample_series(const KernelTables& kernel, const SumSource* sources,
                       std::span<const std::uint32_t> far, const Vec3& centre, LocalExpansion& expansion) {
  with_truth(kernel.interpolated, [&](auto interpolated) HWY_ATTR {
    add_structs<interpolated.value>(kernel, sources, far, centre, expansion);
  });
}

// A row of a kernel's cells.
template <bool kInterpolated>
struct CoarseCell {
  Float4 fields[kInterpolated ? 2 : 1];
};

// For a number of kernels that the compiler knows: their sums stay in registers.
template <bool kInterpolated, std::size_t kCount>
HWY_INLINE std::uint64_t add_nodes(const KernelTables* kernels, const CoarseTest& test, SortedNodes& lists,
                                   std::span<Float4> totals) {
  const F df;
  const std::size_t lanes = hn::Lanes(df), count = lists.work.size();
  const VF cx = hn::Set(df, test.centre.x), cy = hn::Set(df, test.centre.y), cz = hn::Set(df, test.centre.z);
  VF sums[kCount][3];
  for (auto& channels : sums) channels[0] = channels[1] = channels[2] = hn::Zero(df);
  std::uint64_t added = 0;
  lists.work.pad();
  for (std::size_t i = 0; i < count; i += lanes) {
    const Batch batch = load_batch(lists.work, i);
    const auto [x, y, z, radius] = load_fields(test.nodes, batch.indices, kNodeX);
    const auto [red, green, blue, spare] = load_fields(test.nodes, batch.indices, kNodePower);
    const VF counts = load_fields(test.nodes, batch.indices, kNodeSpread).d;
    const VF r = hn::Sqrt(length2(hn::Sub(x, cx), hn::Sub(y, cy), hn::Sub(z, cz)));
    const auto has_children = hn::RebindMask(
        df, hn::Ne(hn::ShiftRight<SumNode::kChildShift>(hn::BitCast(U(), counts)), hn::Zero(U())));
    const auto open =
        hn::And(hn::And(batch.valid, has_children), hn::Gt(radius, hn::Mul(hn::Set(df, test.ratio), r)));
    append(lists.opened, lists.opened.room(lanes), batch.index, open);
    const auto taken = hn::AndNot(open, batch.valid);
    added += hn::CountTrue(df, taken);
    const VF distance =
        test.certified ? hn::Add(hn::Add(r, radius), hn::Set(df, test.slack)) : hn::Max(r, radius);
    const VF r2 = hn::Mul(distance, distance);
    const VF powers[] = {hn::IfThenElseZero(taken, red), hn::IfThenElseZero(taken, green),
                         hn::IfThenElseZero(taken, blue)};
    for (std::size_t g = 0; g < kCount; ++g) {
      const KernelTables& kernel = kernels[g];
      const auto* const cells = reinterpret_cast<const CoarseCell<kInterpolated>*>(kernel.cells);
      HWY_ALIGN std::uint32_t rows[hn::MaxLanes(df)];
      store_cells(kernel.cell_bins, r2, rows);
      FourFields value = load_fields(cells, rows, 0);
      if constexpr (kInterpolated) {
        const FourFields delta = load_fields(cells, rows, 4);
        const VF fraction = find_fraction(kernel.cell_bins, r2);
        value.a = hn::MulAdd(fraction, delta.a, value.a);
        value.b = hn::MulAdd(fraction, delta.b, value.b);
        value.c = hn::MulAdd(fraction, delta.c, value.c);
      }
      sums[g][0] = hn::MulAdd(powers[0], value.a, sums[g][0]);
      sums[g][1] = hn::MulAdd(powers[1], value.b, sums[g][1]);
      sums[g][2] = hn::MulAdd(powers[2], value.c, sums[g][2]);
    }
  }
  for (std::size_t g = 0; g < kCount; ++g)
    for (std::size_t k = 0; k < 3; ++k) totals[g][k] += hn::GetLane(hn::SumOfLanes(df, sums[g][k]));
  return added * kCount;
}

template <bool kInterpolated>
HWY_INLINE std::uint64_t add_nodes(std::span<const KernelTables> kernels, const CoarseTest& test,
                                   SortedNodes& lists, std::span<Float4> totals) {
  switch (kernels.size()) {
    case 1:
      return add_nodes<kInterpolated, 1>(kernels.data(), test, lists, totals);
    case 2:
      return add_nodes<kInterpolated, 2>(kernels.data(), test, lists, totals);
    case 3:
      return add_nodes<kInterpolated, 3>(kernels.data(), test, lists, totals);
    default:
      return add_nodes<kInterpolated, kMostCoarse>(kernels.data(), test, lists, totals);
  }
}

std::uint64_t add_coarsely(std::span<const KernelTables> kernels, const CoarseTest& test, SortedNodes& lists,
                           std::span<Float4> totals) {
  return kernels[0].interpolated ? add_nodes<true>(kernels, test, lists, totals)
                                 : add_nodes<false>(kernels, test, lists, totals);
}

}  // namespace nacre::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nacre::lanes {

HWY_EXPORT(add_sources);
HWY_EXPORT(add_node_series);
HWY_EXPORT(add_sample_series);
HWY_EXPORT(add_coarsely);

void add_sources(const KernelTables& kernel, const SourceList& list, const Vec3& x,
                 std::array<double, 3>& total) {
  HWY_DYNAMIC_DISPATCH(add_sources)(kernel, list, x, total);
}
void add_series(const KernelTables& kernel, const SumNode* nodes, std::span<const std::uint32_t> far,
                const Vec3& centre, LocalExpansion& expansion) {
  HWY_DYNAMIC_DISPATCH(add_node_series)(kernel, nodes, far, centre, expansion);
}
void add_series(const KernelTables& kernel, const SumSource* sources, std::span<const std::uint32_t> far,
                const Vec3& centre, LocalExpansion& expansion) {
  HWY_DYNAMIC_DISPATCH(add_sample_series)(kernel, sources, far, centre, expansion);
}
std::uint64_t add_coarsely(std::span<const KernelTables> kernels, const CoarseTest& test, SortedNodes& lists,
                           std::span<Float4> totals) {
  return HWY_DYNAMIC_DISPATCH(add_coarsely)(kernels, test, lists, totals);
}

}  // namespace nacre::lanes
#endif
