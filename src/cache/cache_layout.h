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

// What lights send, each for itself: irradiance where there are several, errors, ratios.
inline constexpr Kind kLights{'L', 'I', 'T', 'E'};
inline constexpr Kind kErrors{'I', 'R', 'R', 'E'};
inline constexpr Kind kRatios{'E', 'T', 'A', 'R'};

// The order of sections: two of the file, then for each group its texts, planes and nodes; since version 2
// what is known of its lights.
inline constexpr std::array<Kind, 2> kOfFile{kFingerprint, kInfo};
inline constexpr auto kPerGroup1 = [] {
  std::array<Kind, kPlaneCount + 2> kinds{kGroup};
  for (std::size_t i = 0; i < kPlaneCount; ++i) kinds[1 + i] = kPlanes[i];
  kinds.back() = kNodes;
  return kinds;
}();
inline constexpr auto kPerGroup2 = [] {
  std::array<Kind, kPlaneCount + 5> kinds{};
  for (std::size_t i = 0; i < kPerGroup1.size(); ++i) kinds[i] = kPerGroup1[i];
  kinds[kPlaneCount + 2] = kLights;
  kinds[kPlaneCount + 3] = kErrors;
  kinds[kPlaneCount + 4] = kRatios;
  return kinds;
}();
inline constexpr const char* kOrigin = "make one with `nacre bake SCENE -o {}`";
inline constexpr const char* kRemedy = "bake the cache again";
inline constexpr std::array<FileKind, kCacheVersion> kCacheFiles{
    {{kMagic, 1, kOfFile, kPerGroup1, "cache", kOrigin, kRemedy},
     {kMagic, 2, kOfFile, kPerGroup2, "cache", kOrigin, kRemedy}}};

}  // namespace nacre::layout
