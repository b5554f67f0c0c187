// Radiance HDR files before they are decoded.
#pragma once

#include <string>

namespace nacre {

/// Throws Error(kSyntax, path) unless the pixels of a Radiance HDR file of that size are all there and each
/// scanline's runs fill it: stb's decoder would go round for ever on a run of nothing, which is what the end
/// of a file looks like to it, or make up what is missing. Throws Error(kUnsupported, path) for the run
/// lengths of before 1991.
void check_hdr_pixels(const std::string& bytes, int width, int height, const std::string& path);

}  // namespace nacre
