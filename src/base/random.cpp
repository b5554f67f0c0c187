// Hashing, SplitMix64 and hash-based Owen scrambling.
#include "nacre/base/random.h"

#include <array>

namespace nacre {
namespace {

std::uint32_t reverse_bits(std::uint32_t x) noexcept {
  x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  return __builtin_bswap32(x);
}

// Laine-Karras permutation with Burley's constants: scrambles each bit by the bits below it.
std::uint32_t permute_upward(std::uint32_t x, std::uint32_t seed) noexcept {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

std::uint32_t owen_scramble(std::uint32_t x, std::uint32_t seed) noexcept {
  return reverse_bits(permute_upward(reverse_bits(x), seed));
}

// Second Sobol dimension: direction numbers of the Pascal matrix modulo 2.
std::uint32_t sobol_second(std::uint32_t index) noexcept {
  std::uint32_t result = 0;
  for (std::uint32_t v = 1u << 31; index != 0; index >>= 1, v ^= v >> 1)
    if (index & 1u) result ^= v;
  return result;
}

// Third one: primitive polynomial x^2 + x + 1, first direction numbers 1 and 3 (Joe & Kuo 2008).
constexpr std::array<std::uint32_t, 32> third_directions() {
  std::array<std::uint32_t, 32> v{1u << 31, 3u << 30};
  for (std::size_t i = 2; i < v.size(); ++i) v[i] = v[i - 1] ^ v[i - 2] ^ (v[i - 2] >> 2);
  return v;
}
std::uint32_t sobol_third(std::uint32_t index) noexcept {
  static constexpr std::array<std::uint32_t, 32> kDirections = third_directions();
  std::uint32_t result = 0;
  for (std::size_t i = 0; index != 0; index >>= 1, ++i)
    if (index & 1u) result ^= kDirections[i];
  return result;
}

}  // namespace

std::uint64_t hash_words(std::uint64_t a, std::uint64_t b, std::uint64_t c, std::uint64_t d) noexcept {
  std::uint64_t h = mix_bits(a + 0x9e3779b97f4a7c15ull);
  h = mix_bits(h ^ (b + 0x9e3779b97f4a7c15ull + (h << 6)));
  h = mix_bits(h ^ (c + 0x9e3779b97f4a7c15ull + (h << 6)));
  return mix_bits(h ^ (d + 0x9e3779b97f4a7c15ull + (h << 6)));
}

Vec2 sobol_2d(std::uint32_t index, std::uint64_t scramble) noexcept {
  const std::uint64_t seeds = mix_bits(scramble + 0x9e3779b97f4a7c15ull);
  // Shuffling the order as well decorrelates the sequences of neighbouring pixels and lights.
  const std::uint32_t shuffled =
      owen_scramble(index, static_cast<std::uint32_t>(scramble ^ (scramble >> 32)));
  return {to_unit_float(owen_scramble(reverse_bits(shuffled), static_cast<std::uint32_t>(seeds))),
          to_unit_float(owen_scramble(sobol_second(shuffled), static_cast<std::uint32_t>(seeds >> 32)))};
}

Vec3 sobol_3d(std::uint32_t index, std::uint64_t scramble) noexcept {
  const std::uint64_t seeds = mix_bits(scramble + 0x9e3779b97f4a7c15ull), third = mix_bits(seeds);
  const std::uint32_t shuffled =
      owen_scramble(index, static_cast<std::uint32_t>(scramble ^ (scramble >> 32)));
  return {to_unit_float(owen_scramble(reverse_bits(shuffled), static_cast<std::uint32_t>(seeds))),
          to_unit_float(owen_scramble(sobol_second(shuffled), static_cast<std::uint32_t>(seeds >> 32))),
          to_unit_float(owen_scramble(sobol_third(shuffled), static_cast<std::uint32_t>(third)))};
}

float sobol_1d(std::uint32_t index, std::uint64_t scramble) noexcept {
  const std::uint32_t shuffled =
      owen_scramble(index, static_cast<std::uint32_t>(scramble ^ (scramble >> 32)));
  return to_unit_float(owen_scramble(reverse_bits(shuffled), static_cast<std::uint32_t>(mix_bits(scramble))));
}

}  // namespace nacre
