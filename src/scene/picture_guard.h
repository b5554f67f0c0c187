// Pictures before stb decodes them, which trusts their lengths.
#pragma once

#include <string>

namespace nacre {

/// Throws Error(kSyntax, path) unless a PNG file's chunks lie within it: stb's decoder would take two
/// gigabytes of memory for one that says it is as long.
void check_png_chunks(const std::string& bytes, const std::string& path);

/// Throws Error(kSyntax, path) if a JPEG file's Huffman tables have more codes than there are: stb's decoder
/// would write them beyond the end of its own.
void check_jpeg_tables(const std::string& bytes, const std::string& path);

/// Throws Error(kSyntax, path) unless the pixels of a Radiance HDR file of that size are all there and each
/// scanline's runs fill it: stb's decoder would go round for ever on a run of nothing, which is what the end
/// of a file looks like to it, or make up what is missing. Throws Error(kUnsupported, path) for the run
/// lengths of before 1991.
void check_hdr_pixels(const std::string& bytes, int width, int height, const std::string& path);

}  // namespace nacre
