// Holes: their outlines, and triangles over them.
#include "nacre/geometry/fill_holes.h"

#include <algorithm>
#include <limits>
#include <unordered_map>

#include "geometry/edge_table.h"

namespace nacre {
namespace {

// Edges of the largest loop that is triangulated at once with the least area, which takes the cube of them.
constexpr std::size_t kMostEdges = 1000;

// The share of its longest side, squared, that a triangle's area has to exceed.
constexpr double kSliver = 1e-6;

using Loop = std::vector<std::uint32_t>;

// Edges that wait for a face, by the vertex where they begin.
class OpenEdges {
 public:
  explicit OpenEdges(std::span<const Triangle> triangles) {
    for_each_edge(sorted_sides(triangles), [&](std::span<const Side> edge) {
      if (edge.size() != 1) return;
      const auto [low, high, corner, forward] = edge.front();
      const std::uint32_t from = forward ? high : low;  // the other way than the face that is there
      if (ends_[from].empty()) starts_.push_back(from);
      ends_[from].push_back(forward ? low : high);
    });
  }
  const std::vector<std::uint32_t>& starts() const { return starts_; }
  bool leads_on(std::uint32_t vertex) const {
    const auto found = ends_.find(vertex);
    return found != ends_.end() && !found->second.empty();
  }
  std::uint32_t take(std::uint32_t vertex) {
    std::vector<std::uint32_t>& ends = ends_[vertex];
    const std::uint32_t end = ends.back();
    ends.pop_back();
    return end;
  }

 private:
  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> ends_;
  std::vector<std::uint32_t> starts_;
};

// Loops that visit no vertex twice; counts edges that are in none.
std::vector<Loop> find_loops(std::span<const Triangle> triangles, std::size_t& left) {
  OpenEdges edges(triangles);
  std::vector<Loop> loops;
  Loop path;
  std::unordered_map<std::uint32_t, std::size_t> places;
  for (const std::uint32_t start : edges.starts())
    while (edges.leads_on(start)) {
      path.assign(1, start);
      places = {{start, 0}};
      while (edges.leads_on(path.back())) {
        const std::uint32_t next = edges.take(path.back());
        const auto [found, is_new] = places.try_emplace(next, path.size());
        if (is_new) {
          path.push_back(next);
          continue;
        }
        const auto begin = path.begin() + static_cast<std::ptrdiff_t>(found->second);
        loops.emplace_back(begin, path.end());
        for (auto vertex = begin + 1; vertex != path.end(); ++vertex) places.erase(*vertex);
        path.erase(begin + 1, path.end());
      }
      left += path.size() - 1;
    }
  return loops;
}

// Twice the area, and a little for a triangle that has none: along a straight border they come for free.
double triangle_cost(const std::vector<Vec3>& positions, const Triangle& t, double little) {
  const Vec3d a(positions[t[0]]), ab = Vec3d(positions[t[1]]) - a, ac = Vec3d(positions[t[2]]) - a;
  const double area = ab.cross(ac).length();
  return area > kSliver * std::max({ab.length2(), ac.length2(), (ac - ab).length2()}) ? area : area + little;
}

// Triangles over a loop that have the least area together.
void triangulate(const Loop& loop, const std::vector<Vec3>& positions, std::vector<Triangle>& triangles) {
  const std::size_t n = loop.size();
  double length = 0;
  for (std::size_t i = 0; i < n; ++i)
    length += (Vec3d(positions[loop[(i + 1) % n]]) - Vec3d(positions[loop[i]])).length();
  const double little = kSliver * square(length);
  std::vector<double> least(n * n, 0.0);  // from corner i to corner k
  std::vector<std::uint32_t> middle(n * n, 0);
  for (std::size_t span = 2; span < n; ++span)
    for (std::size_t i = 0; i + span < n; ++i) {
      const std::size_t k = i + span;
      double best = std::numeric_limits<double>::infinity();
      for (std::size_t j = i + 1; j < k; ++j) {
        const double area = least[i * n + j] + least[j * n + k] +
                            triangle_cost(positions, {loop[i], loop[j], loop[k]}, little);
        if (area >= best) continue;
        best = area;
        middle[i * n + k] = static_cast<std::uint32_t>(j);
      }
      least[i * n + k] = best;
    }
  std::vector<std::array<std::size_t, 2>> open{{0, n - 1}};
  while (!open.empty()) {
    const auto [i, k] = open.back();
    open.pop_back();
    if (k < i + 2) continue;
    const std::size_t j = middle[i * n + k];
    triangles.push_back({loop[i], loop[j], loop[k]});
    open.push_back({i, j});
    open.push_back({j, k});
  }
}

// The same for a loop of any length: over every so many of its corners first, then between these and the
// others. At a border that turns smoothly little is lost.
void triangulate_coarsely(const Loop& loop, const std::vector<Vec3>& positions,
                          std::vector<Triangle>& triangles) {
  const std::size_t step = (loop.size() + kMostEdges - 1) / kMostEdges;
  Loop coarse;
  for (std::size_t begin = 0; begin < loop.size(); begin += step) {
    coarse.push_back(loop[begin]);
    Loop chain;
    for (std::size_t i = begin; i <= std::min(begin + step, loop.size()); ++i)
      chain.push_back(loop[i % loop.size()]);
    if (chain.size() > 2) triangulate(chain, positions, triangles);
  }
  triangulate(coarse, positions, triangles);
}

// Adds the triangles of one hole, with vertices of their own where normals are given.
void add_patch(Mesh& mesh, std::vector<Triangle> patch) {
  if (!mesh.normals.empty()) {
    std::unordered_map<std::uint32_t, std::uint32_t> copies;
    for (Triangle& t : patch) {
      const Vec3 a = mesh.positions[t[0]];
      const Vec3 area = cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a);
      for (std::uint32_t& vertex : t) {
        const auto [found, is_new] =
            copies.try_emplace(vertex, static_cast<std::uint32_t>(mesh.positions.size()));
        if (is_new) {
          mesh.positions.push_back(Vec3(mesh.positions[vertex]));
          mesh.normals.push_back(Vec3(0));
          if (!mesh.uvs.empty()) mesh.uvs.push_back(Vec2(mesh.uvs[vertex]));
        }
        vertex = found->second;
        mesh.normals[vertex] += area;
      }
    }
    for (const auto& [from, copy] : copies) {
      Vec3& normal = mesh.normals[copy];
      normal = normal.length() > 0 ? normal.normalized() : mesh.normals[from];
    }
  }
  mesh.triangles.insert(mesh.triangles.end(), patch.begin(), patch.end());
}

}  // namespace

std::size_t fill_holes(Mesh& mesh, const std::string& place, Warnings& warnings) {
  std::size_t left = 0;
  const std::vector<Loop> loops = find_loops(welded_triangles(mesh), left);
  for (const Loop& loop : loops) {
    std::vector<Triangle> patch;
    triangulate_coarsely(loop, mesh.positions, patch);
    add_patch(mesh, std::move(patch));
  }
  if (left > 0)
    warnings.push_back(
        fmt::format("{}: {} boundary edges form no loop, beside edges of more than two faces, and stay open",
                    place, left));
  return loops.size();
}

}  // namespace nacre
