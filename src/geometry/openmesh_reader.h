// Files as OpenMesh's readers see them.
#pragma once

#include <string>

#include "geometry/mesh_guard.h"
#include "geometry/raw_mesh.h"

namespace nacre {

enum class MeshFormat { kObj, kPly, kStl, kOff };

/// Throws Error(kSyntax | kValue, path).
RawMesh read_with_openmesh(MeshFormat format, GuardedFile file, const std::string& path);

}  // namespace nacre
