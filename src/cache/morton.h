// Bits of Morton codes.
#pragma once

#include <cstdint>

namespace nacre {

/// Spreads 21 bits so that two zero bits follow each.
inline std::uint64_t spread_bits(std::uint64_t x) noexcept {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x1f00000000ffffull;
  x = (x | x << 16) & 0x1f0000ff0000ffull;
  x = (x | x << 8) & 0x100f00f00f00f00full;
  x = (x | x << 4) & 0x10c30c30c30c30c3ull;
  return (x | x << 2) & 0x1249249249249249ull;
}

/// The inverse, whatever the other bits are.
inline std::uint64_t gather_bits(std::uint64_t x) noexcept {
  x &= 0x1249249249249249ull;
  x = (x | x >> 2) & 0x10c30c30c30c30c3ull;
  x = (x | x >> 4) & 0x100f00f00f00f00full;
  x = (x | x >> 8) & 0x1f0000ff0000ffull;
  x = (x | x >> 16) & 0x1f00000000ffffull;
  return (x | x >> 32) & 0x1fffff;
}

}  // namespace nacre
