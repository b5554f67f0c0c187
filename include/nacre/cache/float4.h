// Three channels and a spare in one register.
#pragma once

namespace nacre {

/// r, g, b and one unused lane, by the compiler's vector extension: arithmetic works lane by lane.
using Float4 = float __attribute__((vector_size(16)));

inline Float4 broadcast(float x) noexcept { return Float4{x, x, x, x}; }
/// Whether a <= b in all of r, g, b.
inline bool all_at_most(Float4 a, Float4 b) noexcept {
  const auto greater = a > b;
  return (greater[0] | greater[1] | greater[2]) == 0;
}

}  // namespace nacre
