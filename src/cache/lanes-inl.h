// What the inner loops have in common, once for every vector instruction set.
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>

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
// And of a SumSource.
enum SourceField { kSourceX, kSourceY, kSourceZ };

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
