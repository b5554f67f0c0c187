// What the inner loops have in common, once for every vector instruction set.
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

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

HWY_INLINE Float4 mul_add(Float4 a, Float4 b, Float4 c) {
#if HWY_TARGET == HWY_SCALAR
  return a * b + c;
#else
  const hn::FixedTag<float, 4> d;
  const auto load = [&](const Float4& x) HWY_ATTR { return hn::Load(d, reinterpret_cast<const float*>(&x)); };
  Float4 sum;
  hn::Store(hn::MulAdd(load(a), load(b), load(c)), d, reinterpret_cast<float*>(&sum));
  return sum;
#endif
}

// Where a distance lies in a table: the cell, and the fraction of it.
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
  const F df;
  HWY_ALIGN float copies[4 * hn::MaxLanes(df)];
  const float* const from = reinterpret_cast<const float*>(structs) + first;
  for (std::size_t k = 0; k < hn::Lanes(df); ++k)
    std::memcpy(copies + 4 * k, from + sizeof(Struct) / sizeof(float) * indices[k], 4 * sizeof(float));
  FourFields fields;
  hn::LoadInterleaved4(df, copies, fields.a, fields.b, fields.c, fields.d);
  return fields;
}
// One.
template <class Struct>
HWY_INLINE VF gather(const Struct* structs, hn::Vec<U> index, int field) {
  const I di;
  return hn::GatherIndex(F(), reinterpret_cast<const float*>(structs) + field,
                         hn::Mul(hn::BitCast(di, index),
                                 hn::Set(di, static_cast<std::int32_t>(sizeof(Struct) / sizeof(float)))));
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
