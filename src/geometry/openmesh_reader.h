// Files as OpenMesh's readers see them: every vertex and face as the file has it, before anything is checked
// or triangulated.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "geometry/mesh_guard.h"
#include "nacre/base/math.h"

namespace nacre {

enum class MeshFormat { kObj, kPly, kStl, kOff };

struct RawMesh {
  std::vector<Vec3> positions;
  std::vector<std::size_t> face_ends;  // where each face ends in `corners`
  std::vector<std::uint32_t> corners;  // indices into positions, perhaps out of range
  // Empty, or one for each position or each corner; zero where the file has none.
  std::vector<Vec3> normals;
  std::vector<Vec2> uvs;
  bool attributes_by_corner = false;
};

/// Throws Error(kSyntax | kValue, path).
RawMesh read_with_openmesh(MeshFormat format, GuardedFile file, const std::string& path);

}  // namespace nacre
