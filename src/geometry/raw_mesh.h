// A mesh as its file has it, every vertex and face, before anything is checked or triangulated.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nacre/base/error.h"
#include "nacre/geometry/mesh.h"

namespace nacre {

struct RawMesh {
  std::vector<Vec3> positions;
  std::vector<std::size_t> face_ends;  // where each face ends in `corners`
  std::vector<std::uint32_t> corners;  // indices into positions, perhaps out of range
  // Empty, or one for each position or each corner; zero where the file has none.
  std::vector<Vec3> normals;
  std::vector<Vec2> uvs;
  bool attributes_by_corner = false;
};

/// What load_mesh says of its mesh; a warning also counts the `dropped_faces` that the reader left out.
/// Throws Error(kSyntax | kValue, path).
Mesh assemble_mesh(RawMesh raw, std::uint64_t dropped_faces, const std::string& path, Warnings& warnings);

}  // namespace nacre
