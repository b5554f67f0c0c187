// A hash of all that an image file says.
#pragma once

#include <string>

#include "nacre/render/image_file.h"

namespace nacre {

/// Of size, window, channels in the order of their names, and metadata but for kDigestKey: 32 digits.
std::string image_digest(const Image& image);

}  // namespace nacre
