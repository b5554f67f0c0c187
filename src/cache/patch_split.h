// How a triangle is divided into patches.
#pragma once

#include <algorithm>
#include <cstdint>

namespace nacre {

// How a triangle is divided, once turned so that the edges concerned come in this order.
enum Pattern : std::uint32_t {
  kOneEdge,        // ab
  kTwoEdges,       // ab and ca, the rest divided from the middle of ab to c
  kTwoEdgesOther,  // the same, from b to the middle of ca
  kThreeEdges,
  kPatternMask = 3,
  kTurnShift = 2,  // then by how many vertices it was turned
};

// Marks of a part: what it is, if not flat, and what is known of the values at its nodes.
enum PartMark : std::uint32_t {
  kSmooth = 1,
  kSteep = 2,
  kKnown = kSmooth | kSteep,
  kCurved = 4,
  kDivided = 8
};

inline std::uint32_t part_count(std::uint32_t pattern) {
  constexpr std::uint32_t kCounts[] = {2, 3, 3, 4};
  return kCounts[pattern & kPatternMask];
}

// The part of a divided triangle that a point is in, and its weights there.
inline std::uint32_t find_part(std::uint32_t pattern, float& u, float& v) noexcept {
  float w = std::max(1 - u - v, 0.0f);
  for (std::uint32_t turn = pattern >> kTurnShift; turn > 0; --turn) {  // a b c -> b c a
    const float first = w;
    w = u;
    u = v;
    v = first;
  }
  const auto go = [&](std::uint32_t part, float part_u, float part_v) {
    u = part_u;
    v = part_v;
    return part;
  };
  switch (pattern & kPatternMask) {
    case kOneEdge:
      return w >= u ? go(0, 2 * u, v) : go(1, u - w, v);
    case kTwoEdges:
      if (w >= 0.5f) return go(0, 2 * u, 2 * v);
      return u >= w ? go(1, u - w, v) : go(2, v - w + u, 2 * (w - u));
    case kTwoEdgesOther:
      if (w >= 0.5f) return go(0, 2 * u, 2 * v);
      return v >= w ? go(1, v - w, 2 * w) : go(2, u - w + v, 2 * v);
    default:
      if (w >= 0.5f) return go(0, 2 * u, 2 * v);
      if (u >= 0.5f) return go(1, u - w - v, 2 * v);
      if (v >= 0.5f) return go(2, 2 * u, v - w - u);
      return go(3, 1 - 2 * u, 1 - 2 * v);
  }
}

}  // namespace nacre
