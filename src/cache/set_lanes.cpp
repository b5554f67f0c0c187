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

// Kernels side by side.
using K = hn::CappedTag<float, KernelSet::kLanes>;
using VK = hn::Vec<K>;

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
  HWY_INLINE VK operator()(std::size_t i, std::size_t field, std::size_t lane) const {
    const float* const at =
        table + (static_cast<std::size_t>(row[i]) * kFields + field) * kStep * width + lane;
    if constexpr (kInterpolated)
      return hn::MulAdd(hn::Set(K(), fraction[i]), hn::LoadU(K(), at + width), hn::LoadU(K(), at));
    else
      return hn::LoadU(K(), at);
  }
};

HWY_INLINE void add_to(float* to, VK value) { hn::StoreU(hn::Add(hn::LoadU(K(), to), value), K(), to); }

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
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t v = 0; v < set.padded(); v += hn::Lanes(K())) {
        const std::size_t first = k * set.padded() + v;
        const auto power_of = [&](std::size_t i) HWY_ATTR {
          if constexpr (kOwnPowers)
            return hn::LoadU(K(), powers + power_row(power[i]) * set.width() + first);
          else
            return hn::Set(K(), power[i][k]);
        };
        VK even = hn::Zero(K()), odd = even;
        std::size_t i = 0;
        for (; i + 1 < size; i += 2) {
          even = hn::MulAdd(power_of(i), rows(i, 0, first), even);
          odd = hn::MulAdd(power_of(i + 1), rows(i + 1, 0, first), odd);
        }
        if (i < size) even = hn::MulAdd(power_of(i), rows(i, 0, first), even);
        HWY_ALIGN float sums[KernelSet::kLanes];
        hn::Store(hn::Add(even, odd), K(), sums);
        for (std::size_t lane = 0; lane < hn::Lanes(K()); ++lane)
          totals[k * set.padded() + v + lane] += static_cast<double>(sums[lane]);
      }
  }
}

// Calls `action` with two compile-time truths.
template <class Action>
HWY_INLINE void with_constants(bool a, bool b, const Action& action) {
  constexpr std::true_type kYes;
  constexpr std::false_type kNo;
  if (a)
    b ? action(kYes, kYes) : action(kYes, kNo);
  else
    b ? action(kNo, kYes) : action(kNo, kNo);
}

void add_set_sources(const KernelSet& set, const SourceList& list, const float* powers, const Vec3& x,
                     std::span<double> totals) {
  with_constants(set.interpolated(), powers != nullptr, [&](auto interpolated, auto own) HWY_ATTR {
    add_list<interpolated.value, own.value>(set, list, powers, x, totals);
  });
}

// What a source is weighted by, apart from kernels: its power, where that is the same for all of them, times
// its offset's monomials, and with second moments times their trace and twice what they stretch along it.
enum Weight { kOne, kX, kY, kZ, kXX, kYY, kZZ, kYZ, kZX, kXY, kTrace, kStretch, kWeights };

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
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t i = 0; i < size; ++i) {
        const float power = kOwnPowers ? 1 : structs[indices[i]].power[k], x = offsets[i][0],
                    y = offsets[i][1], z = offsets[i][2];
        const float px = power * x, py = power * y, pz = power * z;
        float* const w = weights[i];
        w[kOne] = power;
        w[kX] = px;
        w[kY] = py;
        w[kZ] = pz;
        w[kXX] = px * x;
        w[kYY] = py * y;
        w[kZZ] = pz * z;
        w[kYZ] = py * z;
        w[kZX] = pz * x;
        w[kXY] = px * y;
        w[kTrace] = kMoments ? power * traces[i] : 0;
        w[kStretch] = kMoments ? power * stretches[i] : 0;
      }
      for (std::size_t v = 0; v < set.padded(); v += hn::Lanes(K())) {
        const std::size_t lane = k * set.padded() + v;
        // Each sum in a register of its own.
        const VK none = hn::Zero(K());
        VK value = none, trace = none, x = none, y = none, z = none, xx = none, yy = none, zz = none,
           yz = none, zx = none, xy = none;
        for (std::size_t i = 0; i < size; ++i) {
          const float* const w = weights[i];
          const auto weight = [&](Weight which) HWY_ATTR { return hn::Set(K(), w[which]); };
          VK level = values(i, 0, lane), radial = jets(i, 0, lane), bend = jets(i, 1, lane);
          if constexpr (kOwnPowers) {
            const VK power = hn::LoadU(K(), powers + indices[i] * width + lane);
            level = hn::Mul(level, power);
            radial = hn::Mul(radial, power);
            bend = hn::Mul(bend, power);
          }
          value = hn::MulAdd(weight(kOne), level, value);
          if constexpr (kMoments)
            value = hn::MulAdd(weight(kTrace), radial, hn::MulAdd(weight(kStretch), bend, value));
          trace = hn::MulAdd(weight(kOne), radial, trace);
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
        add_to(to + SetExpansion::kValue * width, value);
        add_to(to + SetExpansion::kX * width, x);
        add_to(to + SetExpansion::kY * width, y);
        add_to(to + SetExpansion::kZ * width, z);
        add_to(to + SetExpansion::kXX * width, hn::Add(xx, trace));
        add_to(to + SetExpansion::kYY * width, hn::Add(yy, trace));
        add_to(to + SetExpansion::kZZ * width, hn::Add(zz, trace));
        add_to(to + SetExpansion::kYZ * width, yz);
        add_to(to + SetExpansion::kZX * width, zx);
        add_to(to + SetExpansion::kXY * width, xy);
      }
    }
  }
}

void add_set_nodes(const KernelSet& set, const SumNode* nodes, const float* powers,
                   std::span<const std::uint32_t> far, const Vec3& centre, float* expansion) {
  with_constants(set.interpolated(), powers != nullptr, [&](auto interpolated, auto own) HWY_ATTR {
    add_structs<interpolated.value, own.value>(set, nodes, powers, far, centre, expansion);
  });
}
void add_set_samples(const KernelSet& set, const SumSource* sources, const float* powers,
                     std::span<const std::uint32_t> far, const Vec3& centre, float* expansion) {
  with_constants(set.interpolated(), powers != nullptr, [&](auto interpolated, auto own) HWY_ATTR {
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
