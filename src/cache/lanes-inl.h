// What the inner loops have in common, once for every vector instruction set.
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <type_traits>

#include "cache/sum_lanes.h"

#if defined(NACRE_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef NACRE_LANES_INL_H_
#undef NACRE_LANES_INL_H_
#else
#define NACRE_LANES_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace nacre::lanes::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using F = hn::ScalableTag<float>;
using I = hn::RebindToSigned<F>;
using U = hn::RebindToUnsigned<F>;
using VF = hn::Vec<F>;
using VI = hn::Vec<I>;

// As many Float4 side by side as a vector holds, for sums whose terms have three channels.
#if HWY_TARGET == HWY_SCALAR
using Quads = Float4;
constexpr std::size_t kQuads = 1;
// `at(i)` is where the i-th of them is.
template <class At>
HWY_INLINE Quads load_quads(const At& at) {
  return *at(0);
}
HWY_INLINE Quads load_row(const Float4* from) { return *from; }
HWY_INLINE Quads spread_quads(const float* from) { return broadcast(*from); }
template <int kLane>
HWY_INLINE Quads spread(Quads a) {
  return broadcast(a[kLane]);
}
HWY_INLINE Quads mul(Quads a, Quads b) { return a * b; }
HWY_INLINE Quads add(Quads a, Quads b) { return a + b; }
HWY_INLINE Quads mul_add(Quads a, Quads b, Quads c) { return a * b + c; }
HWY_INLINE Quads no_quads() { return broadcast(0); }
HWY_INLINE Quads first_quads(Quads a, std::size_t) { return a; }
HWY_INLINE Float4 sum(Quads a) { return a; }
#else
using Quads = VF;
constexpr std::size_t kQuads = hn::MaxLanes(F()) / 4;
static_assert(kQuads == 1 || kQuads == 2 || kQuads == 4);
using Quad = hn::FixedTag<float, 4>;
// `get(i)` is the i-th of them.
template <class Get>
HWY_INLINE Quads join_quads(const Get& get) {
  if constexpr (kQuads == 1) {
    return get(0);
  } else if constexpr (kQuads == 2) {
    return hn::Combine(F(), get(1), get(0));
  } else {
    const hn::Half<F> half;
    return hn::Combine(F(), hn::Combine(half, get(3), get(2)), hn::Combine(half, get(1), get(0)));
  }
}
template <class At>
HWY_INLINE Quads load_quads(const At& at) {
  return join_quads([&](std::size_t i)
                        HWY_ATTR { return hn::LoadU(Quad(), reinterpret_cast<const float*>(at(i))); });
}
// Neighbouring floats, each in all lanes of its own: made in registers, as a vector that is read from where
// parts of it were just written waits for them.
HWY_INLINE Quads spread_quads(const float* from) {
  return join_quads([&](std::size_t i) HWY_ATTR { return hn::Set(Quad(), from[i]); });
}
HWY_INLINE Quads load_row(const Float4* from) { return hn::LoadU(F(), reinterpret_cast<const float*>(from)); }
// One lane of each in all of its lanes.
template <int kLane>
HWY_INLINE Quads spread(Quads a) {
  return hn::Broadcast<kLane>(a);
}
HWY_INLINE Quads mul(Quads a, Quads b) { return hn::Mul(a, b); }
HWY_INLINE Quads add(Quads a, Quads b) { return hn::Add(a, b); }
HWY_INLINE Quads mul_add(Quads a, Quads b, Quads c) { return hn::MulAdd(a, b, c); }
HWY_INLINE Quads no_quads() { return hn::Zero(F()); }
// The first `count`, and nothing.
HWY_INLINE Quads first_quads(Quads a, std::size_t count) {
  return count >= kQuads ? a : hn::IfThenElseZero(hn::FirstN(F(), 4 * count), a);
}
HWY_INLINE Float4 sum(Quads a) {
  HWY_ALIGN Float4 parts[kQuads];
  hn::Store(a, F(), reinterpret_cast<float*>(parts));
  for (std::size_t i = 1; i < kQuads; ++i) parts[0] += parts[i];
  return parts[0];
}
#endif

// Calls `action` with a truth that the compiler knows.
template <class Action>
HWY_INLINE void with_truth(bool truth, const Action& action) {
  if (truth)
    action(std::true_type());
  else
    action(std::false_type());
}

// Where a distance lies in a table: the cell, and the fraction of it.
HWY_INLINE VI find_cell(const DistanceBins& bins, VF r2) {
  const I di;
  const VI cell = hn::ShiftRightSame(hn::BitCast(di, r2), bins.shift);
  return hn::Sub(hn::Min(hn::Max(cell, hn::Set(di, bins.first)), hn::Set(di, bins.last)),
                 hn::Set(di, bins.first));
}
// The same as indices in memory, for load_fields.
HWY_INLINE void store_cells(const DistanceBins& bins, VF r2, std::uint32_t* to) {
  hn::Store(hn::BitCast(U(), find_cell(bins, r2)), U(), to);
}
HWY_INLINE VF find_fraction(const DistanceBins& bins, VF r2) {
  const F df;
  const I di;
  const std::int32_t mask = (1 << bins.shift) - 1;
  return hn::Mul(hn::ConvertTo(df, hn::And(hn::BitCast(di, r2), hn::Set(di, mask))),
                 hn::Set(df, 1.0f / static_cast<float>(1 << bins.shift)));
}

// Where a run of squared distances lies in a table.
template <bool kInterpolated, std::size_t kRun>
struct RunRows {
  HWY_ALIGN std::int32_t row[kRun];
  HWY_ALIGN float fraction[kInterpolated ? kRun : 1];

  HWY_INLINE void find(std::size_t i, const DistanceBins& bins, VF r2) {
    hn::Store(find_cell(bins, r2), I(), row + i);
    if constexpr (kInterpolated) hn::Store(find_fraction(bins, r2), F(), fraction + i);
  }
};

HWY_INLINE VF length2(VF x, VF y, VF z) { return hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z))); }

// A vector of indices, and which of them are of the list: it has to be padded.
struct Batch {
  const std::uint32_t* indices;
  hn::Vec<U> index;
  hn::Mask<F> valid;
};
HWY_INLINE Batch load_batch(const IndexList& list, std::size_t i) {
  const F df;
  const std::uint32_t* const indices = list.data() + i;
  return {indices, hn::LoadU(U(), indices), hn::FirstN(df, std::min(list.size() - i, hn::Lanes(df)))};
}

// Four neighbouring fields of structures of floats, for a vector of indices. Structure by structure: gathers
// take longer.
struct FourFields {
  VF a, b, c, d;
};
template <class Struct>
HWY_INLINE FourFields load_fields(const Struct* structs, const std::uint32_t* indices, int first) {
  const float* const from = reinterpret_cast<const float*>(structs) + first;
  const auto at = [&](std::size_t i) HWY_ATTR {
    return reinterpret_cast<const Float4*>(from + sizeof(Struct) / sizeof(float) * indices[i]);
  };
#if HWY_TARGET == HWY_SCALAR
  const F df;
  const Float4 fields = *at(0);
  return {hn::Set(df, fields[0]), hn::Set(df, fields[1]), hn::Set(df, fields[2]), hn::Set(df, fields[3])};
#else
  // Blocks of four structures each are transposed.
  const auto load = [&](std::size_t i) HWY_ATTR {
    return load_quads([&](std::size_t block) HWY_ATTR { return at(4 * block + i); });
  };
  const F df;
  const hn::Repartition<double, F> pairs;
  const auto lower = [&](VF a, VF b) HWY_ATTR { return hn::BitCast(pairs, hn::InterleaveLower(df, a, b)); };
  const auto upper = [&](VF a, VF b) HWY_ATTR { return hn::BitCast(pairs, hn::InterleaveUpper(df, a, b)); };
  const VF s0 = load(0), s1 = load(1), s2 = load(2), s3 = load(3);
  const auto ab01 = lower(s0, s1), ab23 = lower(s2, s3), cd01 = upper(s0, s1), cd23 = upper(s2, s3);
  return {hn::BitCast(df, hn::InterleaveLower(pairs, ab01, ab23)),
          hn::BitCast(df, hn::InterleaveUpper(pairs, ab01, ab23)),
          hn::BitCast(df, hn::InterleaveLower(pairs, cd01, cd23)),
          hn::BitCast(df, hn::InterleaveUpper(pairs, cd01, cd23))};
#endif
}
// The fields of a SumNode, float by float.
enum NodeField {
  kNodeX,
  kNodeY,
  kNodeZ,
  kNodeRadius,
  kNodeSpread,
  kNodeLean,
  kNodeFirst,
  kNodeCounts,
  kNodePower,
  kNodeXX = 12,
  kNodeYY,
  kNodeZZ,
  kNodeYZ,
  kNodeZX,
  kNodeXY,
  kNodeTint
};
// And of a SumSource, of Limits.
enum SourceField { kSourceX, kSourceY, kSourceZ };
enum LimitField { kLean, kBend, kAsPoint, kInSeries };

// A run of sources that a series takes in: their indices and offsets from its centre, padded to whole
// vectors.
template <class Struct>
HWY_INLINE void find_offsets(const Struct* structs, std::span<const std::uint32_t> run, const Vec3& centre,
                             std::uint32_t* indices, Float4* offsets) {
  const std::size_t size = run.size(), lanes = hn::Lanes(F());
  const Float4 middle{centre.x, centre.y, centre.z, 0};
  std::copy_n(run.data(), size, indices);
  std::fill_n(indices + size, lanes, indices[size - 1]);
  for (std::size_t i = 0; i < size; ++i) {
    const Struct& s = structs[indices[i]];
    offsets[i] = middle - Float4{s.x, s.y, s.z, 0};
  }
  for (std::size_t i = size; i % lanes != 0; ++i) offsets[i] = offsets[size - 1];
}

// Second moments of nodes as seen along (x, y, z): their trace, and twice what they stretch along it.
struct SeenMoments {
  VF trace, stretch;
};
HWY_INLINE SeenMoments find_moments(const SumNode* nodes, const std::uint32_t* indices, VF x, VF y, VF z) {
  const F df;
  const auto [xx, yy, zz, yz] = load_fields(nodes, indices, kNodeXX);
  const auto [zx, xy, tint, spare] = load_fields(nodes, indices, kNodeZX);
  const VF across = hn::MulAdd(hn::Mul(x, y), xy, hn::MulAdd(hn::Mul(y, z), yz, hn::Mul(hn::Mul(z, x), zx)));
  const VF along = hn::MulAdd(hn::Mul(x, x), xx, hn::MulAdd(hn::Mul(y, y), yy, hn::Mul(hn::Mul(z, z), zz)));
  return {hn::Add(xx, hn::Add(yy, zz)), hn::MulAdd(hn::Set(df, 2), across, along)};
}

// Stores the lanes of `mask` side by side, and as many more as a vector has; gives their number.
#if HWY_TARGET == HWY_AVX2
// Highway's own goes through a table that GCC 12 copies to the stack each time.
struct CompressTable {
  alignas(64) std::array<std::uint32_t, 256> lanes{};  // by mask: the lanes that are set, 4 bits each
  constexpr CompressTable() {
    for (std::uint32_t mask = 0; mask < 256; ++mask)
      for (std::uint32_t lane = 0, shift = 0; lane < 8; ++lane)
        if (mask >> lane & 1) {
          lanes[mask] |= lane << shift;
          shift += 4;
        }
  }
};
inline constexpr CompressTable kCompressTable;

template <class D>
HWY_INLINE std::size_t store_lanes(hn::Vec<D> values, hn::Mask<F> mask, D d, hn::TFromD<D>* to) {
  const U du;
  std::uint8_t bits[8];
  hn::StoreMaskBits(F(), mask, bits);
  const auto lane = hn::Shr(hn::Set(du, kCompressTable.lanes[bits[0]]), hn::ShiftLeft<2>(hn::Iota(du, 0)));
  const auto indices = hn::IndicesFromVec(d, hn::And(lane, hn::Set(du, 7)));
  hn::StoreU(hn::TableLookupLanes(values, indices), d, to);
  return static_cast<std::size_t>(std::popcount(bits[0]));
}
#elif HWY_TARGET <= HWY_AVX3
// In a register: to memory the instruction takes some CPUs a hundred cycles.
template <class D>
HWY_INLINE std::size_t store_lanes(hn::Vec<D> values, hn::Mask<F> mask, D d, hn::TFromD<D>* to) {
  hn::StoreU(hn::Compress(values, hn::RebindMask(d, mask)), d, to);
  return hn::CountTrue(F(), mask);
}
#else
template <class D>
HWY_INLINE std::size_t store_lanes(hn::Vec<D> values, hn::Mask<F> mask, D d, hn::TFromD<D>* to) {
  return hn::CompressStore(values, hn::RebindMask(d, mask), d, to);
}
#endif

HWY_INLINE void append(IndexList& list, std::uint32_t* room, hn::Vec<U> index, hn::Mask<F> mask) {
  list.grow(store_lanes(index, mask, U(), room));
}

}  // namespace nacre::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
