// A look at an OpenEXR header before OpenEXR reads it.
#pragma once

#include <cstdint>
#include <exception>
#include <string>
#include <string_view>

namespace nacre {

/// Most pixels of an image that is written or read.
inline constexpr std::int64_t kMaxImagePixels = std::int64_t{1} << 28;
/// Longest header that is read, in bytes.
inline constexpr std::size_t kMaxExrHeader = std::size_t{4} << 20;

/// OpenEXR allocates what a header asks for before it looks whether the file holds as much; this holds the
/// header's sizes against the file first. `head` is the file's beginning: kMaxExrHeader bytes or all of it.
/// Throws Error: kSyntax, kUnsupported (deep or multi-part files, unknown versions), kLimit.
/// Source: "OpenEXR File Layout" of the OpenEXR project.
void check_exr_header(std::string_view head, std::uint64_t file_bytes, const std::string& path);

/// Throws kSyntax with the reason that OpenEXR gave for not reading a file, on one line.
[[noreturn]] void fail_damaged_exr(const std::string& path, const std::exception& error);

}  // namespace nacre
