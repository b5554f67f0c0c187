// Samples of a cache as a point cloud, for programs that can show one.
#pragma once

#include <string>

#include "nacre/cache/cache.h"

namespace nacre {

/// Writes the samples of all groups in octree order: binary PLY if `path` ends in .ply, else text with a
/// header line if it ends in .csv. Columns x,y,z,nx,ny,nz,area,er,eg,eb,group: scene units, E_t for the eta
/// that the cache was baked with, the index of the group. A PLY file also holds, as comments, what the cache
/// was baked from. Endings may be in upper case. Throws Error(kIo, path); kUnsupported for others.
void export_cloud(const Cache& cache, const std::string& path);

/// Makes a cache from a PLY file with those columns, in any order, of any type, text or binary; others are
/// skipped. Of a file as export_cloud wrote it that has the same samples and nodes, bit for bit, is for the
/// index of refraction that it was baked with, and knows of no single lights, errors or other indices. Where
/// another program has dropped the comments, `like` has to say what the samples were baked from. Throws Error
/// with `path`: kIo, kNotFound, kSyntax, kUnsupported, kValue, kLimit; kValue also for what no bake makes:
/// numbers above 1e15, normals without direction, more than a tenth of a group's points where others are,
/// areas of a group that add up to less than half of its surface or more than twice.
Cache import_cloud(const std::string& path, const Cache* like = nullptr);

}  // namespace nacre
