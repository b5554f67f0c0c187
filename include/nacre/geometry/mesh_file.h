// Reading and writing mesh files through OpenMesh: obj, ply (ASCII and binary, both byte orders), stl, off.
#pragma once

#include <string>

#include "nacre/base/error.h"
#include "nacre/geometry/mesh.h"

namespace nacre {

/// Whether the file name ends in .obj, .ply, .stl or .off (any case).
bool is_mesh_file_name(const std::string& path);

/// Loads a mesh with whatever normals and texture coordinates the file has; polygons are triangulated. Faces
/// that use a vertex twice and vertices that no face uses are dropped, with one warning that counts them.
/// Every face of the file is kept even where OpenMesh would duplicate vertices (non-manifold edges,
/// inconsistent orientation). Throws Error: kNotFound, kIo, kSyntax (not of the format), kUnsupported
/// (unknown extension), kValue (no triangle; a coordinate that is NaN or infinite), always with `path` as the
/// place.
Mesh load_mesh(const std::string& path, Warnings& warnings);

/// Writes binary PLY or OBJ by extension: positions, triangles, normals and texture coordinates if present.
/// The file appears under its name only when it is complete. Throws Error(kIo | kUnsupported).
void save_mesh(const Mesh& mesh, const std::string& path);

}  // namespace nacre
