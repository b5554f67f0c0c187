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

// Calls `action` with a tag and the first lane for each vector of a set's lanes.
template <class Action>
HWY_INLINE void for_each_vector(const KernelSet& set, const Action& action) {
  std::size_t lane = 0;
  for (; lane + hn::Lanes(Wide()) <= set.width(); lane += hn::Lanes(Wide())) action(Wide(), lane);
  for (; lane < set.width(); lane += hn::Lanes(Narrow())) action(Narrow(), lane);
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

// What lanes from `lane` on see of a power: each its channel's, or with kOwnPowers what a row has for it.
template <bool kOwnPowers, class D>
struct LanePowers {
  D d;
#if HWY_TARGET == HWY_SCALAR
  std::uint32_t channel;
#else
  decltype(hn::SetTableIndices(D(), static_cast<const std::int32_t*>(nullptr))) channels;
#endif
  const float* rows;
  std::size_t width;

  HWY_INLINE LanePowers(D tag, const KernelSet& set, const float* powers, std::size_t lane)
      : d(tag),
#if HWY_TARGET == HWY_SCALAR
        channel(set.channels()[lane]),
#else
        channels(hn::SetTableIndices(d, reinterpret_cast<const std::int32_t*>(set.channels() + lane))),
#endif
        rows(powers + (kOwnPowers ? lane : 0)),
        width(set.width()) {
  }
  HWY_INLINE hn::Vec<D> get(const Float4& power, std::size_t row) const {
    if constexpr (kOwnPowers)
      return hn::LoadU(d, rows + row * width);
    else
#if HWY_TARGET == HWY_SCALAR
      return hn::Set(d, power[static_cast<int>(channel)]);
#else
      return hn::TableLookupLanes(hn::LoadDup128(d, reinterpret_cast<const float*>(&power)), channels);
#endif
  }
};

template <class D>
HWY_INLINE void add_to(D d, float* to, hn::Vec<D> value) {
  hn::StoreU(hn::Add(hn::LoadU(d, to), value), d, to);
}

// With kOwnPowers each kernel sees a light of its own.
template <bool kInterpolated, bool kOwnPowers>
HWY_INLINE void add_list(const KernelSet& set, const SourceList& list, const float* powers, const Vec3& x,
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
    const Float4* const power = list.powers() + begin;
    for_each_vector(set, [&](auto d, std::size_t lane) HWY_ATTR {
      using D = decltype(d);
      const LanePowers<kOwnPowers, D> seen(d, set, powers, lane);
      const auto term = [&](std::size_t i, hn::Vec<D> sum) HWY_ATTR {
        return hn::MulAdd(seen.get(power[i], power_row(power[i])), rows.get(d, i, 0, lane), sum);
      };
      hn::Vec<D> even = hn::Zero(d), odd = even;
      std::size_t i = 0;
      for (; i + 1 < size; i += 2) {
        even = term(i, even);
        odd = term(i + 1, odd);
      }
      if (i < size) even = term(i, even);
      HWY_ALIGN float sums[hn::MaxLanes(d)];
      hn::Store(hn::Add(even, odd), d, sums);
      for (std::size_t k = 0; k < hn::Lanes(d); ++k) totals[lane + k] += static_cast<double>(sums[k]);
    });
  }
}

void add_set_sources(const KernelSet& set, const SourceList& list, const float* powers, const Vec3& x,
                     std::span<double> totals) {
  with_truths(set.interpolated(), powers != nullptr, [&](auto interpolated, auto own) HWY_ATTR {
    add_list<interpolated.value, own.value>(set, list, powers, x, totals);
  });
}

// Monomials of a source's offset, and of second moments their trace and twice what they stretch along it.
enum Weight { kX, kY, kZ, kXX, kYY, kZZ, kYZ, kZX, kXY, kTrace, kStretch, kWeights };

template <bool kInterpolated, bool kOwnPowers, class Struct>
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
    for_each_vector(set, [&](auto d, std::size_t lane) HWY_ATTR {
      using D = decltype(d);
      using V = hn::Vec<D>;
      const LanePowers<kOwnPowers, D> seen(d, set, powers, lane);
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
  with_truths(set.interpolated(), powers != nullptr, [&](auto interpolated, auto own) HWY_ATTR {
    add_structs<interpolated.value, own.value>(set, nodes, powers, far, centre, expansion);
  });
}
void add_set_samples(const KernelSet& set, const SumSource* sources, const float* powers,
                     std::span<const std::uint32_t> far, const Vec3& centre, float* expansion) {
  with_truths(set.interpolated(), powers != nullptr, [&](auto interpolated, auto own) HWY_ATTR {
    add_structs<interpolated.value, own.value>(set, sources, powers, far, centre, expansion);
  });
}

}  // namespace nacre::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nacre::lanes {

HWY_EXPORT(add_set_sources);
HWY_EXPORT(add_set_nodes);
HWY_EXPORT(add_set_samples);

void add_sources(const KernelSet& set, const SourceList& list, const float* powers, const Vec3& x,
                 std::span<double> totals) {
  HWY_DYNAMIC_DISPATCH(add_set_sources)(set, list, powers, x, totals);
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
