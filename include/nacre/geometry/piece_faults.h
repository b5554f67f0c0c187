// How the pieces of a surface lie to each other: copies, pieces inside others, shells without thickness.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "nacre/geometry/mesh.h"

namespace nacre {

enum class PieceFault {
  kCopy,      // lies exactly on another piece, facing the same way
  kNearCopy,  // lies closer than `near` to another piece, facing the same way
  kBackSide,  // lies exactly on another piece, facing the other way
  kFlat,      // closed, and encloses nothing
  kInside,    // faces outward, with all of it inside other pieces
};

/// Pieces of one mesh that have the same fault.
struct FaultyPieces {
  PieceFault fault = PieceFault::kCopy;
  std::size_t mesh = 0, other = 0;  // which mesh they are in, and which one the first of them lies on or in;
                                    // may be the same
  std::size_t pieces = 0;
};

/// Finds what is wrong with meshes that are the surface of one body. A piece is what hangs together by welded
/// vertices of one mesh. It lies on another if half of it does, at points that are spread over it evenly by
/// area, and inside if every one of them is, seen from four directions each; of two pieces that lie on each
/// other the later one is faulty, and nothing else is said about it. Bodies that touch or overlap, cavities
/// (which face inward) and open sheets are no faults. `near` is a length, at most a hundredth of a piece's
/// size counts.
std::vector<FaultyPieces> find_faulty_pieces(std::span<const Mesh* const> meshes, float near);

}  // namespace nacre
