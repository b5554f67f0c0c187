// Mesh files: obj, ply (ASCII and binary, both byte orders), stl, off, read through OpenMesh.
#pragma once

#include <string>

#include "nacre/base/error.h"
#include "nacre/geometry/mesh.h"

namespace nacre {

/// Whether the file name ends in .obj, .ply, .stl or .off (any case).
bool is_mesh_file_name(const std::string& path);

/// Loads a mesh with whatever normals and texture coordinates the file has; vertices are split where those
/// differ by corner (OBJ), polygons triangulated, colours, materials and groups ignored. A vertex without a
/// normal in a file that has some gets the average over its faces. Every face of the file is kept even where
/// a half-edge mesh could not hold it (non-manifold edges, inconsistent orientation), but faces that use a
/// vertex twice and vertices that no face uses are dropped, with one warning that counts them. Throws Error:
/// kNotFound, kIo, kSyntax (not of the format, truncated), kUnsupported (unknown extension; what a format
/// allows but OpenMesh cannot read), kValue (no triangle; a number that is NaN or infinite), kLimit (more
/// than 8 GB), always with `path` as the place; the reason names the line of a text.
Mesh load_mesh(const std::string& path, Warnings& warnings);

/// Writes binary PLY or OBJ by extension: positions, triangles, normals and texture coordinates if present,
/// every float exactly.
/// The file appears under its name only when it is complete. Throws Error(kIo | kUnsupported).
void save_mesh(const Mesh& mesh, const std::string& path);

}  // namespace nacre
