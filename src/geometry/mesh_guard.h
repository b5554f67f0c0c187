// What keeps OpenMesh's readers out of trouble: they skip lines that they cannot parse, trust every count and
// open files that a mesh file names. Each guard checks the bytes of a file, throws Error(kSyntax | kValue |
// kUnsupported, path) with the line, and returns the bytes in a form that OpenMesh reads to the end.
#pragma once

#include <cstdint>
#include <string>

namespace nacre {

struct GuardedFile {
  std::string content;
  bool binary = false;
  std::uint64_t faces = 0;     // as the file counts them; OpenMesh leaves out degenerate ones without a word
  std::uint64_t vertices = 0;  // PLY only: as the header counts them
  /// PLY only: what to add to a line number of `content` to get that of the file.
  std::int64_t line_shift = 0;
};

GuardedFile guard_obj(std::string content, const std::string& path);
GuardedFile guard_stl(std::string content, const std::string& path);
/// Also sets OpenMesh's reader to the flavour (normals, texture coordinates) that the file at `path` has.
GuardedFile guard_off(std::string content, const std::string& path);
/// Checks the header and writes it anew in the words that OpenMesh knows. The values of the body are not
/// looked at: read it from a stream that throws.
GuardedFile guard_ply(std::string content, const std::string& path);

}  // namespace nacre
