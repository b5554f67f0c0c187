// The fixed parts of a cache file; see FORMAT.md.
#pragma once

#include <array>
#include <cstdint>

#include "nacre/cache/cache.h"

namespace nacre::layout {

inline constexpr std::array<unsigned char, 8> kMagic{0x89, 'N', 'A', 'C', 'R', 'E', 0x0d, 0x0a};
inline constexpr std::uint32_t kEndianMark = 0x0a0b0c0d;
inline constexpr std::uint64_t kAlignment = 64;
inline constexpr std::uint32_t kMaxSections = 1u << 20;

struct Header {
  std::array<unsigned char, 8> magic;
  std::uint32_t version;
  std::uint32_t endian_mark;
  std::uint64_t file_size;
  std::uint32_t section_count;
  std::uint32_t group_count;
  std::uint64_t table_checksum;
  std::uint64_t reserved[2];
  std::uint64_t header_checksum;  // of the 56 bytes before it
};
static_assert(sizeof(Header) == 64);

struct SectionEntry {
  std::array<char, 4> kind;
  std::uint32_t group;  // 0 for sections of the whole file
  std::uint64_t offset, size, checksum;
};
static_assert(sizeof(SectionEntry) == 32);

inline constexpr std::array<char, 4> kFingerprint{'F', 'I', 'N', 'G'};
inline constexpr std::array<char, 4> kInfo{'I', 'N', 'F', 'O'};
inline constexpr std::array<char, 4> kGroup{'G', 'R', 'U', 'P'};
inline constexpr std::array<char, 4> kNodes{'N', 'O', 'D', 'E'};
inline constexpr std::array<std::array<char, 4>, kPlaneCount> kPlanes{{{'P', 'O', 'S', 'X'},
                                                                       {'P', 'O', 'S', 'Y'},
                                                                       {'P', 'O', 'S', 'Z'},
                                                                       {'N', 'R', 'M', 'X'},
                                                                       {'N', 'R', 'M', 'Y'},
                                                                       {'N', 'R', 'M', 'Z'},
                                                                       {'A', 'R', 'E', 'A'},
                                                                       {'I', 'R', 'R', 'R'},
                                                                       {'I', 'R', 'R', 'G'},
                                                                       {'I', 'R', 'R', 'B'}}};

}  // namespace nacre::layout
