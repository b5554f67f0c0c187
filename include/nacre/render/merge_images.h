// One picture from files that hold parts of it.
#pragma once

#include <string>
#include <vector>

#include "nacre/render/image_file.h"

namespace nacre {

/// Metadata of a part: a digest of all that the whole picture depends on.
inline constexpr const char* kSettingsKey = "nacre:settings";

/// Puts OpenEXR files together whose data windows share out one display window, each pixel as it is; the
/// metadata is that of the first, without kSettingsKey and nacre:key. Throws what load_exr throws;
/// Error(kDamaged, path) for a part with a broken seal; Error(kMismatch, path) for a part of another frame,
/// with other channels or other metadata (nacre:command and nacre:key excepted), one that overlaps another,
/// and for pixels that are in none; Error(kLimit, path) for a frame of more than 2^28 pixels.
Image merge_images(const std::vector<std::string>& paths);

}  // namespace nacre
