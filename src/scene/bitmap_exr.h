// OpenEXR for load_bitmap.
#pragma once

#include <cstdint>
#include <string>

#include "nacre/scene/bitmap.h"

namespace nacre {

inline constexpr std::int64_t kMaxBitmapPixels = std::int64_t{1} << 27;

/// The texels of an OpenEXR file that is in memory: R, G and B, or Y alone as grey. Throws Error with `path`.
Bitmap decode_exr(const std::string& bytes, const std::string& path);

}  // namespace nacre
