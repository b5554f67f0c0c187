// Sorting of edges, union-find, cutting.
#include "geometry/edge_table.h"

#include <numeric>
#include <tuple>

#include "nacre/base/parallel.h"

namespace nacre {

std::vector<Side> sorted_sides(std::span<const Triangle> triangles) {
  std::vector<Side> sides(3 * triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t from = triangles[i][k], to = triangles[i][(k + 1) % 3];
      sides[3 * i + k] = {std::min(from, to), std::max(from, to), static_cast<std::uint32_t>(3 * i + k),
                          from < to};
    }
  parallel_sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.low, a.high, a.corner) < std::tie(b.low, b.high, b.corner);
  });
  return sides;
}

DisjointSets::DisjointSets(std::size_t count) : parents_(count) {
  std::iota(parents_.begin(), parents_.end(), 0u);
}

std::uint32_t DisjointSets::find(std::uint32_t item) {
  while (parents_[item] != item) item = parents_[item] = parents_[parents_[item]];
  return item;
}

void DisjointSets::unite(std::uint32_t a, std::uint32_t b) {
  a = find(a);
  b = find(b);
  parents_[std::max(a, b)] = std::min(a, b);
}

std::vector<Triangle> welded_triangles(const Mesh& mesh) {
  const std::vector<std::uint32_t> weld = weld_map(mesh);
  std::vector<Triangle> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    const Triangle w = {weld[t[0]], weld[t[1]], weld[t[2]]};
    if (w[0] != w[1] && w[1] != w[2] && w[2] != w[0]) triangles.push_back(w);
  }
  return triangles;
}

ManifoldCut cut_to_manifold(std::span<const Triangle> triangles, const std::vector<Side>& sides) {
  // Corners are the same vertex if one can walk from one to the other across regular edges.
  DisjointSets corners(3 * triangles.size());
  const auto next = [](std::uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; };
  for_each_edge(sides, [&](std::span<const Side> edge) {
    if (!is_regular(edge)) return;
    corners.unite(edge[0].corner, next(edge[1].corner));
    corners.unite(next(edge[0].corner), edge[1].corner);
  });
  ManifoldCut cut;
  cut.triangles.resize(triangles.size());
  for (std::uint32_t i = 0; i < 3 * triangles.size(); ++i) {
    const std::uint32_t first = corners.find(i);  // the smallest of its set, so its vertex has its number
    if (first == i) {
      cut.triangles[i / 3][i % 3] = static_cast<std::uint32_t>(cut.origins.size());
      cut.origins.push_back(triangles[i / 3][i % 3]);
    } else {
      cut.triangles[i / 3][i % 3] = cut.triangles[first / 3][first % 3];
    }
  }
  return cut;
}

}  // namespace nacre
