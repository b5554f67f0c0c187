// Cache files. Their format is specified byte by byte in src/cache/FORMAT.md.
#pragma once

#include <string>

#include "nacre/cache/cache.h"

namespace nacre {

inline constexpr std::uint32_t kCacheVersion = 2;

/// Writes a cache, in version 1 of the format if nothing is known of its lights but their sum; the file
/// appears under its name only when complete. Throws Error(kIo, path).
void save_cache(const Cache& cache, const std::string& path);

/// Maps a cache file and checks all of it: structure, checksums, links, and that every number is finite and
/// in its range; nothing in the returned cache needs to be checked again. Throws Error with `path` or "path:
/// byte N" as the place: kNotFound, kIo, kNotACache, kNewerVersion, kTruncated, kDamaged (naming the
/// section). `version`, if given, becomes that of the file's format.
Cache load_cache(const std::string& path, std::uint32_t* version = nullptr);

/// Whether a file begins like a cache. False for what cannot be read.
bool is_cache_file(const std::string& path);

}  // namespace nacre
