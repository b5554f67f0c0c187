// Counter-based random numbers: every number is a pure function of (seed, stream, index), so the order of
// work and the number of threads change nothing. Owen-scrambled Sobol points for integrals.
#pragma once

#include <cstdint>

#include "nacre/base/math.h"

namespace nacre {

/// A well-mixed one-to-one map of 64 bits: the finalizer of SplitMix64 (Stafford's variant 13).
inline std::uint64_t mix_bits(std::uint64_t x) noexcept {
  x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ x >> 27) * 0x94d049bb133111ebull;
  return x ^ x >> 31;
}

/// A well-mixed 64-bit hash of up to four words.
std::uint64_t hash_words(std::uint64_t a, std::uint64_t b = 0, std::uint64_t c = 0,
                         std::uint64_t d = 0) noexcept;

/// Uniform in [0, 1), with 24 bits.
inline float to_unit_float(std::uint32_t bits) noexcept { return static_cast<float>(bits >> 8) * 0x1p-24f; }
/// Uniform in [0, 1), with 53 bits.
inline double to_unit_double(std::uint64_t bits) noexcept {
  return static_cast<double>(bits >> 11) * 0x1p-53;
}

/// A short sequence of independent uniforms, keyed by what it is for. Source: Steele et al. 2014
/// (SplitMix64).
class Rng {
 public:
  static constexpr std::uint64_t kStep = 0x9e3779b97f4a7c15ull;  // from one state to the next
  explicit Rng(std::uint64_t key) noexcept : state_(key) {}
  std::uint64_t next_bits() noexcept { return mix_bits(state_ += kStep); }
  float next_float() noexcept { return to_unit_float(static_cast<std::uint32_t>(next_bits() >> 32)); }
  double next_double() noexcept { return to_unit_double(next_bits()); }
  Vec2 next_2d() noexcept {
    const float x = next_float();
    return {x, next_float()};
  }

 private:
  std::uint64_t state_;
};

/// Point `index` of a two-dimensional Owen-scrambled Sobol (0,2)-sequence, in [0,1)^2. Different scrambles
/// give independent randomizations; every prefix of 2^k points is stratified in all elementary intervals.
/// Source: Burley 2020, "Practical hash-based Owen scrambling".
Vec2 sobol_2d(std::uint32_t index, std::uint64_t scramble) noexcept;
/// The same in three dimensions: each pair of coordinates, and all three together, are well distributed,
/// though not in every elementary interval.
Vec3 sobol_3d(std::uint32_t index, std::uint64_t scramble) noexcept;
/// Point `index` of the scrambled van der Corput sequence, in [0,1).
float sobol_1d(std::uint32_t index, std::uint64_t scramble) noexcept;

}  // namespace nacre
