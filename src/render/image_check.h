// What an image has to be before it is written, whatever the format.
#pragma once

#include <string>

#include "base/exr_header.h"
#include "nacre/render/image_file.h"

namespace nacre {

/// Throws Error: kLimit for more than kMaxImagePixels; kValue for an empty window, no channels, a channel
/// without a name, twice or of the wrong size, and any value that is NaN or infinite.
void check_image(const Image& image, const std::string& path);

}  // namespace nacre
