// Mitsuba 0.6's .serialized files: many meshes in one file, each compressed.
#pragma once

#include <cstdint>
#include <string>

#include "nacre/base/error.h"
#include "nacre/geometry/mesh.h"

namespace nacre {

struct SerializedMesh {
  Mesh mesh;                  // as load_mesh would give it; texture coordinates as they are in the file
  bool face_normals = false;  // wants to be shaded flat, and has no normals
};

/// Loads the mesh with that index, counting from 0, of a file of version 3 or 4; reads no other. Vertex
/// colours are left out. Throws Error with `path` as the place: kNotFound, kIo, kSyntax (not of the format,
/// truncated, damaged), kUnsupported (another version), kValue (no such index; no triangle; a coordinate that
/// is not finite), kLimit (more than 8 GB). Memory grows with what the file holds, not with what it claims.
SerializedMesh load_serialized_mesh(const std::string& path, std::uint32_t index, Warnings& warnings);

}  // namespace nacre
