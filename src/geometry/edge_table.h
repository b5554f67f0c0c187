// The edges of a triangle mesh with any number of faces each, and what follows from them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "nacre/geometry/mesh.h"

namespace nacre {

/// One side of a triangle. It goes from corner k to the next one of triangle i, where `corner` is 3 i + k.
struct Side {
  std::uint32_t low, high;  // its vertices, the smaller index first
  std::uint32_t corner;
  bool forward;  // from low to high
};

/// All sides of all triangles, sorted so that those of one edge follow each other. No triangle may use a
/// vertex twice.
std::vector<Side> sorted_sides(std::span<const Triangle> triangles);

/// Calls visit(std::span<const Side>) for each edge.
template <class Visit>
void for_each_edge(const std::vector<Side>& sides, const Visit& visit) {
  for (std::size_t begin = 0, end; begin < sides.size(); begin = end) {
    end = begin + 1;
    while (end < sides.size() && sides[end].low == sides[begin].low && sides[end].high == sides[begin].high)
      ++end;
    visit(std::span<const Side>(sides).subspan(begin, end - begin));
  }
}

/// Whether an edge joins exactly two faces that agree about which side is outside.
inline bool is_regular(std::span<const Side> edge) {
  return edge.size() == 2 && edge[0].forward != edge[1].forward;
}

/// Disjoint sets of 0 ... count - 1.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count);
  std::uint32_t find(std::uint32_t item);
  void unite(std::uint32_t a, std::uint32_t b);

 private:
  std::vector<std::uint32_t> parents_;
};

/// Triangles over the welded surface (see weld_map) without those that use a vertex twice. Indices are still
/// into mesh.positions.
std::vector<Triangle> welded_triangles(const Mesh& mesh);

/// Triangles cut apart along every edge that is not regular and at every vertex where the surface only
/// touches itself, so that they are an oriented manifold with boundary.
struct ManifoldCut {
  std::vector<Triangle> triangles;     // over new vertices
  std::vector<std::uint32_t> origins;  // for each new vertex the one that it is a copy of
};
ManifoldCut cut_to_manifold(std::span<const Triangle> triangles, const std::vector<Side>& sides);

}  // namespace nacre
