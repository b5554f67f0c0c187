// The fixed parts of a cache file; see FORMAT.md.
#pragma once

#include <array>
#include <cstdint>
#include <utility>

#include "nacre/cache/cache.h"

namespace nacre::layout {

inline constexpr std::array<unsigned char, 8> kMagic{0x89, 'N', 'A', 'C', 'R', 'E', 0x0d, 0x0a};
inline constexpr std::uint32_t kEndianMark = 0x0a0b0c0d;
inline constexpr std::uint64_t kAlignment = 64;

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

using Kind = std::array<char, 4>;
inline constexpr Kind kFingerprint{'F', 'I', 'N', 'G'};
inline constexpr Kind kInfo{'I', 'N', 'F', 'O'};
inline constexpr Kind kGroup{'G', 'R', 'U', 'P'};
inline constexpr Kind kNodes{'N', 'O', 'D', 'E'};
inline constexpr std::array<Kind, kPlaneCount> kPlanes{{{'P', 'O', 'S', 'X'},
                                                        {'P', 'O', 'S', 'Y'},
                                                        {'P', 'O', 'S', 'Z'},
                                                        {'N', 'R', 'M', 'X'},
                                                        {'N', 'R', 'M', 'Y'},
                                                        {'N', 'R', 'M', 'Z'},
                                                        {'A', 'R', 'E', 'A'},
                                                        {'I', 'R', 'R', 'R'},
                                                        {'I', 'R', 'R', 'G'},
                                                        {'I', 'R', 'R', 'B'}}};

// The order of sections: two of the file, then for each group its texts, planes and nodes.
inline constexpr std::uint64_t kSectionsPerGroup = kPlaneCount + 2;
constexpr std::uint64_t section_count(std::uint64_t groups) { return 2 + kSectionsPerGroup * groups; }
constexpr std::pair<Kind, std::uint32_t> section_at(std::uint64_t i) {
  if (i < 2) return {i == 0 ? kFingerprint : kInfo, 0};
  const std::uint64_t in_group = (i - 2) % kSectionsPerGroup;
  const auto group = static_cast<std::uint32_t>((i - 2) / kSectionsPerGroup);
  if (in_group == 0) return {kGroup, group};
  return {in_group <= kPlaneCount ? kPlanes[in_group - 1] : kNodes, group};
}
constexpr std::uint64_t align(std::uint64_t offset) {
  return (offset + kAlignment - 1) / kAlignment * kAlignment;
}

}  // namespace nacre::layout
