// Sums and series of several kernels at once, for every vector instruction set, chosen at run time.
#include <algorithm>
#include <type_traits>

#include "cache/kernel_set.h"

#define HWY_COMPILE_ALL_ATTAINABLE  // the plain one, too
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cache/set_lanes.cpp"
#include <hwy/foreach_target.h>

#include "cache/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace nacre::lanes::HWY_NAMESPACE {

// Lanes of a set side by side: as many as a vector holds, half of that where they end before.
using Wide = hn::CappedTag<float, 2 * KernelSet::kStep>;
using Narrow = hn::CappedTag<float, KernelSet::kStep>;

// Calls `action` with a tag, the first lane, and how many vectors from there on, for all of a set's lanes:
// up to `kMost` wide ones at once.
template <std::size_t kMost, class Action>
HWY_INLINE void for_each_vector(const KernelSet& set, const Action& action) {
  using One = std::integral_constant<std::size_t, 1>;
  using Most = std::integral_constant<std::size_t, kMost>;
  const std::size_t wide = hn::Lanes(Wide()), narrow = hn::Lanes(Narrow());
  std::size_t lane = 0;
  for (; lane + kMost * wide <= set.width(); lane += kMost * wide) action(Wide(), lane, Most());
  for (; lane + wide <= set.width(); lane += wide) action(Wide(), lane, One());
  for (; lane < set.width(); lane += narrow) action(Narrow(), lane, One());
}

// What one run of sources finds in a table with `kFields` fields a row.
template <bool kInterpolated, int kFields, std::size_t kRun>
struct SetRows : RunRows<kInterpolated, kRun> {
  using RunRows<kInterpolated, kRun>::row;
  using RunRows<kInterpolated, kRun>::fraction;
  static constexpr std::size_t kStep = kInterpolated ? 2 : 1;
  const float* table;
  std::size_t width;

  HWY_INLINE SetRows(const float* first, std::size_t size) : table(first), width(size) {}
  // From `lane` on.
  template <class D>
  HWY_INLINE hn::Vec<D> get(D d, std::size_t i, std::size_t field, std::size_t lane) const {
    const float* const at =
        table + (static_cast<std::size_t>(row[i]) * kFields + field) * kStep * width + lane;
    if constexpr (kInterpolated)
      return hn::MulAdd(hn::Set(d, fraction[i]), hn::LoadU(d, at + width), hn::LoadU(d, at));
    else
      return hn::LoadU(d, at);
  }
};

// What lanes from `lane` on see of a power, or of a row of powers.
template <KernelSet::Rows kRows, class D>
struct LanePowers {
  using Rows = KernelSet::Rows;
  D d;
  static constexpr std::size_t kLanes = hn::MaxLanes(D()),
                               kParts = kRows == Rows::kFewLights ? KernelSet::kFewColumns / kLanes : 1;
#if HWY_TARGET == HWY_SCALAR
  std::uint32_t column;
#else
  decltype(hn::SetTableIndices(D(), static_cast<const std::int32_t*>(nullptr))) columns;
  hn::Mask<D> in_part[kParts];  // of a row, which of its vectors a lane looks into
#endif
  const float* rows;
  std::size_t width;

  HWY_INLINE LanePowers(D tag, const KernelSet& set, const float* powers, std::size_t lane)
      : d(tag), rows(powers + (kRows == Rows::kLanes ? lane : 0)), width(set.row_width()) {
#if HWY_TARGET == HWY_SCALAR
    column = set.columns()[lane];
#else
    const hn::RebindToSigned<D> di;
    HWY_ALIGN std::int32_t within[kLanes], part[kLanes];
    for (std::size_t i = 0; i < kLanes; ++i) {
      // A row of the lanes' own is read as it is.
      const std::uint32_t of_row = kRows == Rows::kLanes ? 0 : set.columns()[lane + i];
      within[i] = static_cast<std::int32_t>(of_row % kLanes);
      part[i] = static_cast<std::int32_t>(of_row / kLanes);
    }
    columns = hn::SetTableIndices(d, within);
    for (std::size_t p = 0; p < kParts; ++p)
      in_part[p] = hn::RebindMask(d, hn::Eq(hn::Load(di, part), hn::Set(di, static_cast<std::int32_t>(p))));
#endif
  }
  HWY_INLINE hn::Vec<D> get(const Float4& power, std::size_t row) const {
    if constexpr (kRows == Rows::kLanes) return hn::LoadU(d, rows + row * width);
#if HWY_TARGET == HWY_SCALAR
    return hn::Set(d, kRows == Rows::kPower ? power[static_cast<int>(column)] : rows[row * width + column]);
#else
    if constexpr (kRows == Rows::kPower) {
      return hn::TableLookupLanes(hn::LoadDup128(d, reinterpret_cast<const float*>(&power)), columns);
    } else {
      const float* const at = rows + row * KernelSet::kFewColumns;
      hn::Vec<D> seen = hn::TableLookupLanes(hn::LoadU(d, at), columns);
      for (std::size_t p = 1; p < kParts; ++p)
        seen = hn::IfThenElse(in_part[p], hn::TableLookupLanes(hn::LoadU(d, at + p * kLanes), columns), seen);
      return seen;
    }
#endif
  }
};

// Calls `action` with whether a set is interpolated and with its rows, as the compiler knows them.
template <class Action>
HWY_INLINE void with_kind(const KernelSet& set, const Action& action) {
  using Rows = KernelSet::Rows;
  with_truth(set.interpolated(), [&](auto interpolated) HWY_ATTR {
    switch (set.rows()) {
      case Rows::kPower:
        return action(interpolated, std::integral_constant<Rows, Rows::kPower>());
      case Rows::kFewLights:
        return action(interpolated, std::integral_constant<Rows, Rows::kFewLights>());
      case Rows::kLanes:
        return action(interpolated, std::integral_constant<Rows, Rows::kLanes>());
    }
  });
}

template <class D>
HWY_INLINE void add_to(D d, float* to, hn::Vec<D> value) {
  hn::StoreU(hn::Add(hn::LoadU(d, to), value), d, to);
}

// Sources of a list that lie side by side.
struct Run {
  const Float4* powers;
  const float* rows;
  std::size_t size;
};

// Adds a run to the totals of so many vectors of lanes at once.
template <class D, std::size_t kVectors, KernelSet::Rows kRows, class Table>
HWY_INLINE void add_run(const KernelSet& set, const Table& table, const Run& run, std::size_t lane,
                        std::span<double> totals) {
  const D d;
  const std::size_t step = hn::Lanes(d);
  const LanePowers<kRows, D> first(d, set, run.rows, lane),
      last(d, set, run.rows, lane + (kVectors - 1) * step);
  hn::Vec<D> even[kVectors], odd[kVectors];
  for (std::size_t v = 0; v < kVectors; ++v) even[v] = odd[v] = hn::Zero(d);
  const auto add = [&](std::size_t i, hn::Vec<D>* sums) HWY_ATTR {
    for (std::size_t v = 0; v < kVectors; ++v)
      sums[v] = hn::MulAdd((v == 0 ? first : last).get(run.powers[i], i), table.get(d, i, 0, lane + v * step),
                           sums[v]);
  };
  std::size_t i = 0;
  for (; i + 1 < run.size; i += 2) {
    add(i, even);
    add(i + 1, odd);
  }
  if (i < run.size) add(i, even);
  HWY_ALIGN float sums[hn::MaxLanes(d)];
  for (std::size_t v = 0; v < kVectors; ++v) {
    hn::Store(hn::Add(even[v], odd[v]), d, sums);
    for (std::size_t k = 0; k < step; ++k) totals[lane + v * step + k] += static_cast<double>(sums[k]);
  }
}

template <bool kInterpolated, KernelSet::Rows kRows>
HWY_INLINE void add_list(const KernelSet& set, const SourceList& list, const Vec3& x,
                         std::span<double> totals) {
  const F df;
  constexpr std::size_t kRun = 256;
  const std::size_t lanes = hn::Lanes(df);
  const VF cx = hn::Set(df, x.x), cy = hn::Set(df, x.y), cz = hn::Set(df, x.z);
  SetRows<kInterpolated, 1, kRun> rows(set.cells(), set.width());
  for (std::size_t begin = 0; begin < list.size(); begin += kRun) {
    const std::size_t size = std::min(kRun, list.size() - begin);
    for (std::size_t i = 0; i < size; i += lanes) {
      const auto load = [&](SourceList::Field f)
                            HWY_ATTR { return hn::LoadU(df, list.field(f) + begin + i); };
      rows.find(i, set.cell_bins(),
                length2(hn::Sub(load(SourceList::kX), cx), hn::Sub(load(SourceList::kY), cy),
                        hn::Sub(load(SourceList::kZ), cz)));
    }
    const float* const own =
        kRows == KernelSet::Rows::kPower ? nullptr : list.rows() + begin * set.row_width();
    const Run run{list.powers() + begin, own, size};
    for_each_vector<2>(set, [&](auto d, std::size_t lane, auto vectors) HWY_ATTR {
      add_run<decltype(d), vectors.value, kRows>(set, rows, run, lane, totals);
    });
  }
}

void add_set_sources(const KernelSet& set, const SourceList& list, const Vec3& x, std::span<double> totals) {
  with_kind(set, [&](auto interpolated, auto rows)
                     HWY_ATTR { add_list<interpolated.value, rows.value>(set, list, x, totals); });
}

// Monomials of a source's offset, and of second moments their trace and twice what they stretch along it.
enum Weight { kX, kY, kZ, kXX, kYY, kZZ, kYZ, kZX, kXY, kTrace, kStretch, kWeights };

template <bool kInterpolated, KernelSet::Rows kRows, class Struct>
HWY_INLINE void add_structs(const KernelSet& set, const Struct* structs, const float* powers,
                            std::span<const std::uint32_t> far, const Vec3& centre, float* expansion) {
  const F df;
  constexpr std::size_t kRun = 128;
  constexpr bool kMoments = std::is_same_v<Struct, SumNode>;
  const std::size_t lanes = hn::Lanes(df), width = set.width();
  HWY_ALIGN Float4 offsets[kRun];
  std::uint32_t indices[kRun + hn::MaxLanes(df)];
  HWY_ALIGN float traces[kRun], stretches[kRun];
  HWY_ALIGN float weights[kRun][kWeights];
  SetRows<kInterpolated, 1, kRun> values(set.cells(), width);
  SetRows<kInterpolated, 2, kRun> jets(set.jets(), width);
  for (std::size_t begin = 0; begin < far.size(); begin += kRun) {
    const std::size_t size = std::min(kRun, far.size() - begin);
    find_offsets(structs, far.subspan(begin, size), centre, indices, offsets);
    for (std::size_t i = 0; i < size; i += lanes) {
      VF x, y, z, rest;
      hn::LoadInterleaved4(df, reinterpret_cast<const float*>(offsets + i), x, y, z, rest);
      const VF r2 = length2(x, y, z);
      values.find(i, set.cell_bins(), r2);
      jets.find(i, set.jet_bins(), r2);
      if constexpr (kMoments) {
        const auto [trace, stretch] = find_moments(structs, indices + i, x, y, z);
        hn::Store(trace, df, traces + i);
        hn::Store(stretch, df, stretches + i);
      }
    }
    for (std::size_t i = 0; i < size; ++i) {
      const float x = offsets[i][0], y = offsets[i][1], z = offsets[i][2];
      float* const w = weights[i];
      w[kX] = x;
      w[kY] = y;
      w[kZ] = z;
      w[kXX] = x * x;
      w[kYY] = y * y;
      w[kZZ] = z * z;
      w[kYZ] = y * z;
      w[kZX] = z * x;
      w[kXY] = x * y;
      w[kTrace] = kMoments ? traces[i] : 0;
      w[kStretch] = kMoments ? stretches[i] : 0;
    }
    for_each_vector<1>(set, [&](auto d, std::size_t lane, auto) HWY_ATTR {
      using D = decltype(d);
      using V = hn::Vec<D>;
      const LanePowers<kRows, D> seen(d, set, powers, lane);
      // Each sum in a register of its own.
      const V none = hn::Zero(d);
      V value = none, trace = none, x = none, y = none, z = none, xx = none, yy = none, zz = none, yz = none,
        zx = none, xy = none;
      for (std::size_t i = 0; i < size; ++i) {
        const float* const w = weights[i];
        const auto weight = [&](Weight which) HWY_ATTR { return hn::Set(d, w[which]); };
        const V power = seen.get(structs[indices[i]].power, indices[i]);
        value = hn::MulAdd(power, values.get(d, i, 0, lane), value);
        const V radial = hn::Mul(power, jets.get(d, i, 0, lane)),
                bend = hn::Mul(power, jets.get(d, i, 1, lane));
        if constexpr (kMoments)
          value = hn::MulAdd(weight(kTrace), radial, hn::MulAdd(weight(kStretch), bend, value));
        trace = hn::Add(trace, radial);
        x = hn::MulAdd(weight(kX), radial, x);
        y = hn::MulAdd(weight(kY), radial, y);
        z = hn::MulAdd(weight(kZ), radial, z);
        xx = hn::MulAdd(weight(kXX), bend, xx);
        yy = hn::MulAdd(weight(kYY), bend, yy);
        zz = hn::MulAdd(weight(kZZ), bend, zz);
        yz = hn::MulAdd(weight(kYZ), bend, yz);
        zx = hn::MulAdd(weight(kZX), bend, zx);
        xy = hn::MulAdd(weight(kXY), bend, xy);
      }
      float* const to = expansion + lane;
      const auto add = [&](SetExpansion::Coefficient which, V sum)
                           HWY_ATTR { add_to(d, to + which * width, sum); };
      add(SetExpansion::kValue, value);
      add(SetExpansion::kX, x);
      add(SetExpansion::kY, y);
      add(SetExpansion::kZ, z);
      add(SetExpansion::kXX, hn::Add(xx, trace));
      add(SetExpansion::kYY, hn::Add(yy, trace));
      add(SetExpansion::kZZ, hn::Add(zz, trace));
      add(SetExpansion::kYZ, yz);
      add(SetExpansion::kZX, zx);
      add(SetExpansion::kXY, xy);
    });
  }
}

void add_set_nodes(const KernelSet& set, const SumNode* nodes, const float* powers,
                   std::span<const std::uint32_t> far, const Vec3& centre, float* expansion) {
  with_kind(set, [&](auto interpolated, auto rows) HWY_ATTR {
    add_structs<interpolated.value, rows.value>(set, nodes, powers, far, centre, expansion);
  });
}
void add_set_samples(const KernelSet& set, const SumSource* sources, const float* powers,
                     std::span<const std::uint32_t> far, const Vec3& centre, float* expansion) {
  with_kind(set, [&](auto interpolated, auto rows) HWY_ATTR {
    add_structs<interpolated.value, rows.value>(set, sources, powers, far, centre, expansion);
  });
}

}  // namespace nacre::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nacre::lanes {

HWY_EXPORT(add_set_sources);
HWY_EXPORT(add_set_nodes);
HWY_EXPORT(add_set_samples);

void add_sources(const KernelSet& set, const SourceList& list, const Vec3& x, std::span<double> totals) {
  HWY_DYNAMIC_DISPATCH(add_set_sources)(set, list, x, totals);
}
void add_series(const KernelSet& set, const SumNode* nodes, const float* powers,
                std::span<const std::uint32_t> far, const Vec3& centre, SetExpansion& expansion) {
  HWY_DYNAMIC_DISPATCH(add_set_nodes)(set, nodes, powers, far, centre, expansion.data());
}
void add_series(const KernelSet& set, const SumSource* sources, const float* powers,
                std::span<const std::uint32_t> far, const Vec3& centre, SetExpansion& expansion) {
  HWY_DYNAMIC_DISPATCH(add_set_samples)(set, sources, powers, far, centre, expansion.data());
}

}  // namespace nacre::lanes
#endif
