// Joining meshes, connecting faces by welded edges.
#include "bake/group_surface.h"

#include <numeric>

#include "nacre/base/parallel.h"

namespace nacre {
namespace {

struct HalfEdge {
  std::uint64_t key;  // its two welded vertices, the smaller one first
  std::uint32_t triangle;
  std::uint32_t corner;
};

constexpr std::size_t kMostFacesPerEdge = 8;
constexpr std::uint64_t kNoEdge = ~std::uint64_t{0};  // sorts last

// Union-find with path halving.
std::uint32_t find_root(std::vector<std::uint32_t>& parents, std::uint32_t i) {
  while (parents[i] != i) i = parents[i] = parents[parents[i]];
  return i;
}

// Whether a triangle is so thin that the rounding of its vertices, not the surface, decides its normal.
bool is_thin(const GroupSurface& surface, std::size_t triangle, double area) {
  float coordinate = 0;
  for (const std::uint32_t v : surface.triangles[triangle])
    for (int axis = 0; axis < 3; ++axis)
      coordinate = std::max(coordinate, std::abs(surface.positions[v][axis]));
  const double extent = static_cast<double>(surface.extent(triangle));
  return 2 * area <= 0x1p-21 * static_cast<double>(coordinate) * extent;
}

std::vector<HalfEdge> sorted_half_edges(const GroupSurface& surface, const std::vector<std::uint32_t>& weld) {
  std::vector<HalfEdge> edges(surface.triangles.size() * 3);
  parallel_for(surface.triangles.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const Triangle& corners = surface.triangles[t];
      const std::uint64_t v[3] = {weld[corners[0]], weld[corners[1]], weld[corners[2]]};
      // A triangle that has a vertex twice is no more than an edge, and joins nothing.
      const bool collapsed = v[0] == v[1] || v[1] == v[2] || v[2] == v[0];
      for (std::uint32_t c = 0; c < 3; ++c) {
        const std::uint64_t from = v[c], to = v[(c + 1) % 3];
        edges[3 * t + c] = {collapsed ? kNoEdge : std::min(from, to) << 32 | std::max(from, to),
                            static_cast<std::uint32_t>(t), c};
      }
    }
  });
  parallel_sort(edges.begin(), edges.end(), [](const HalfEdge& x, const HalfEdge& y) {
    return x.key != y.key ? x.key < y.key : 3ull * x.triangle + x.corner < 3ull * y.triangle + y.corner;
  });
  return edges;
}

}  // namespace

Vec3 GroupSurface::normal(std::size_t triangle) const {
  const Triangle& t = triangles[triangle];
  return cross(positions[t[1]] - positions[t[0]], positions[t[2]] - positions[t[0]]).normalized();
}

float GroupSurface::extent(std::size_t triangle) const {
  const Triangle& t = triangles[triangle];
  const Vec3 &a = positions[t[0]], &b = positions[t[1]], &c = positions[t[2]];
  return std::sqrt(std::max({(b - a).length2(), (c - b).length2(), (a - c).length2()}));
}

GroupSurface make_group_surface(std::span<const Mesh* const> meshes) {
  GroupSurface surface;
  Mesh joined;  // positions alone, for welding
  for (const Mesh* mesh : meshes) {
    const auto offset = static_cast<std::uint32_t>(joined.positions.size());
    joined.positions.insert(joined.positions.end(), mesh->positions.begin(), mesh->positions.end());
    for (const Triangle& t : mesh->triangles)
      surface.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  }
  const std::vector<std::uint32_t> weld = weld_map(joined);
  surface.positions = std::move(joined.positions);

  std::vector<double> areas(surface.triangles.size());
  parallel_for(areas.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Triangle& t = surface.triangles[i];
      const Vec3d a(surface.positions[t[0]]), b(surface.positions[t[1]]), c(surface.positions[t[2]]);
      areas[i] = 0.5 * (b - a).cross(c - a).length();
    }
  });
  surface.areas = Distribution(areas);

  const std::vector<HalfEdge> edges = sorted_half_edges(surface, weld);
  std::vector<std::uint32_t> parents(surface.triangles.size());
  std::iota(parents.begin(), parents.end(), 0u);
  const auto add_sheet_edge = [&](const HalfEdge& edge) {
    const Triangle& t = surface.triangles[edge.triangle];
    const double area = areas[edge.triangle];
    if (area > 0)
      surface.sheet_edges.push_back(
          {surface.positions[t[edge.corner]], surface.positions[t[(edge.corner + 1) % 3]],
           is_thin(surface, edge.triangle, area) ? Vec3(0) : surface.normal(edge.triangle)});
  };
  for (std::size_t begin = 0; begin < edges.size() && edges[begin].key != kNoEdge;) {
    std::size_t end = begin + 1;
    while (end < edges.size() && edges[end].key == edges[begin].key) ++end;
    for (std::size_t i = begin + 1; i < end; ++i)
      parents[find_root(parents, edges[i].triangle)] = find_root(parents, edges[begin].triangle);
    // A face without a partner that goes on in its direction ends at this edge. Thin ones have no direction
    // and do not count as an end; nor do edges where so many faces meet that they are no border of anything.
    const auto continues = [&](std::size_t i, std::size_t j) {
      const std::uint32_t a = edges[i].triangle, b = edges[j].triangle;
      return is_thin(surface, a, areas[a]) || is_thin(surface, b, areas[b]) ||
             dot(surface.normal(a), surface.normal(b)) > kSameSheetCosine;
    };
    for (std::size_t i = begin; i < end && end - begin <= kMostFacesPerEdge; ++i) {
      bool goes_on = false;
      for (std::size_t j = begin; j < end; ++j) goes_on = goes_on || (i != j && continues(i, j));
      if (!goes_on) add_sheet_edge(edges[i]);
    }
    begin = end;
  }

  surface.components.resize(parents.size());
  std::vector<std::uint32_t> numbers(parents.size(), ~0u);
  for (std::uint32_t t = 0; t < parents.size(); ++t) {
    std::uint32_t& number = numbers[find_root(parents, t)];
    if (number == ~0u) number = surface.component_count++;
    surface.components[t] = number;
  }
  return surface;
}

}  // namespace nacre
