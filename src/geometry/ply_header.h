// Headers of PLY files.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "geometry/text_lines.h"

namespace nacre {

struct PlyType {
  std::size_t bytes;
  bool is_float;
  bool is_signed = true;
};

struct PlyProperty {
  std::string name;
  PlyType type;
  std::optional<PlyType> list;  // the type of a list's length
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  bool binary = false, big_endian = false;
  std::vector<PlyElement> elements;
  std::vector<std::string> comments;  // without the word
};

/// The fewest bytes that an element takes.
std::uint64_t smallest_size(const PlyElement& element, bool binary);

/// Reads a header and leaves `lines` at its last line. Throws Error(kSyntax | kUnsupported) with the line.
PlyHeader parse_ply_header(LineReader& lines);

}  // namespace nacre
