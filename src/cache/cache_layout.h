// The sections of a cache file; see FORMAT.md.
#pragma once

#include <array>
#include <cstdint>

#include "cache/section_file.h"
#include "nacre/cache/cache_file.h"

namespace nacre::layout {

inline constexpr std::array<unsigned char, 8> kMagic{0x89, 'N', 'A', 'C', 'R', 'E', 0x0d, 0x0a};
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
inline constexpr std::array<Kind, 2> kOfFile{kFingerprint, kInfo};
inline constexpr auto kPerGroup = [] {
  std::array<Kind, kPlaneCount + 2> kinds{kGroup};
  for (std::size_t i = 0; i < kPlaneCount; ++i) kinds[1 + i] = kPlanes[i];
  kinds.back() = kNodes;
  return kinds;
}();
inline constexpr FileKind kCacheFile{kMagic,
                                     kCacheVersion,
                                     kOfFile,
                                     kPerGroup,
                                     "cache",
                                     "make one with `nacre bake SCENE -o {}`",
                                     "bake the cache again"};

}  // namespace nacre::layout
