// Space in cubic blocks: what lies in each, and the order in which blocks may be worked on at once.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "nacre/base/math.h"
#include "nacre/base/parallel.h"

namespace nacre {

using BlockAt = std::array<int, 3>;

/// Blocks of one size over a box, hashed into buckets, so that memory follows what is in the box and not the
/// box. A block's phase is the parity of its coordinates, and each phase has buckets of its own: blocks of
/// one phase are a whole block apart, and what is in the buckets of a block's neighbours stays as it is while
/// others of its phase are worked on.
class SpaceBlocks {
 public:
  static constexpr unsigned kPhases = 8;
  /// Blocks along an axis at most; coordinates begin at 1, so that there is room for neighbours.
  static constexpr int kMostBlocks = 1 << 20;

  /// For about so many points.
  SpaceBlocks(const Box3& box, float size, std::size_t points)
      : low_(box.min),
        size_(size),
        inverse_(1 / size),
        mask_(std::bit_ceil(static_cast<std::uint32_t>(
                  std::clamp<std::size_t>(points / kPointsPerBucket >> 3 * kGroupBits, 1, 1u << 20))) -
              1) {}

  BlockAt at(const Vec3& p) const {
    BlockAt block;
    for (int axis = 0; axis < 3; ++axis)
      block[static_cast<std::size_t>(axis)] =
          std::clamp(static_cast<int>(std::min((p[axis] - low_[axis]) * inverse_, 2e6f)), 0,
                     kMostBlocks - 1) +
          1;
    return block;
  }
  Vec3 corner(const BlockAt& b) const {
    return low_ +
           Vec3(static_cast<float>(b[0] - 1), static_cast<float>(b[1] - 1), static_cast<float>(b[2] - 1)) *
               size_;
  }
  static std::uint64_t key(const BlockAt& b) {
    return static_cast<std::uint64_t>(b[2]) << 42 | static_cast<std::uint64_t>(b[1]) << 21 |
           static_cast<std::uint64_t>(b[0]);
  }
  static BlockAt from_key(std::uint64_t key) {
    constexpr std::uint64_t kMask = (1u << 21) - 1;
    return {static_cast<int>(key & kMask), static_cast<int>(key >> 21 & kMask), static_cast<int>(key >> 42)};
  }
  std::uint32_t bucket(const BlockAt& b) const {
    const auto bits = [&](int shift, int mask) {
      return static_cast<std::uint32_t>((b[0] >> shift & mask) | (b[1] >> shift & mask) * (mask + 1) |
                                        (b[2] >> shift & mask) * (mask + 1) * (mask + 1));
    };
    const std::uint64_t group = key({b[0] >> kGroupBits, b[1] >> kGroupBits, b[2] >> kGroupBits});
    const auto hashed = static_cast<std::uint32_t>(group * 0x9e3779b97f4a7c15ull >> 37) & mask_;
    return bits(0, 1) * buckets_per_phase() + (hashed << 2 * 3 | bits(1, 3));
  }
  std::uint32_t buckets_per_phase() const { return (mask_ + 1) << 2 * 3; }
  std::uint32_t bucket_count() const { return kPhases * buckets_per_phase(); }
  float size() const { return size_; }

  /// Calls visit(block) for a block and the 26 around it.
  template <class Visit>
  static void for_each_around(const BlockAt& b, const Visit& visit) {
    for (int z = b[2] - 1; z <= b[2] + 1; ++z)
      for (int y = b[1] - 1; y <= b[1] + 1; ++y)
        for (int x = b[0] - 1; x <= b[0] + 1; ++x) visit(BlockAt{x, y, z});
  }

 private:
  // Blocks that differ in no more than their last bits have buckets side by side, for the caches.
  static constexpr int kGroupBits = 3;
  static constexpr std::size_t kPointsPerBucket = 16;  // a block has more, but most buckets hold none

  Vec3 low_;
  float size_, inverse_;
  std::uint32_t mask_;
};

/// Numbers 0 to count - 1 by bucket, in ascending order in each.
struct Buckets {
  std::vector<std::uint32_t> ends;
  std::vector<std::uint32_t> items;
  std::span<const std::uint32_t> of(std::uint32_t bucket) const {
    const std::size_t begin = bucket ? ends[bucket - 1] : 0;
    return {items.data() + begin, ends[bucket] - begin};
  }
};

/// Sorts by counting, in parallel; `for_each(begin, end, emit)` calls emit(i, bucket) for i from begin to
/// end in order. Eight bytes an item while it runs, four of which stay.
template <class ForEach>
Buckets sort_into_buckets(std::size_t count, std::uint32_t bucket_count, const ForEach& for_each) {
  const std::size_t chunks = std::clamp<std::size_t>(
      count / 16384, 1, std::min<std::size_t>(16, 2 * static_cast<std::size_t>(thread_count())));
  const auto chunk_begin = [&](std::size_t c) { return count * c / chunks; };
  std::vector<std::uint32_t> bucket_of(count), places(chunks * bucket_count);
  parallel_for(chunks, 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t c = first; c < last; ++c) {
      std::uint32_t* counts = places.data() + c * bucket_count;
      for_each(chunk_begin(c), chunk_begin(c + 1), [&](std::size_t i, std::uint32_t bucket) {
        bucket_of[i] = bucket;
        ++counts[bucket];
      });
    }
  });
  Buckets sorted;
  sorted.ends.resize(bucket_count);
  std::uint32_t sum = 0;
  for (std::uint32_t b = 0; b < bucket_count; ++b) {
    for (std::size_t c = 0; c < chunks; ++c) {
      std::uint32_t& place = places[c * bucket_count + b];
      const std::uint32_t here = place;
      place = sum;
      sum += here;
    }
    sorted.ends[b] = sum;
  }
  sorted.items.resize(count);
  parallel_for(chunks, 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t c = first; c < last; ++c)
      for (std::size_t i = chunk_begin(c); i < chunk_begin(c + 1); ++i)
        sorted.items[places[c * bucket_count + bucket_of[i]]++] = static_cast<std::uint32_t>(i);
  });
  return sorted;
}

}  // namespace nacre
