// Holes: their outlines, and triangles over them.
#include "nacre/geometry/fill_holes.h"

#include <algorithm>
#include <limits>
#include <unordered_map>
#include <unordered_set>

#include "geometry/edge_table.h"

namespace nacre {
namespace {

// Edges of the largest loop that is triangulated at once with the least area, which takes the cube of them.
constexpr std::size_t kMostEdges = 1000;

// The share of its longest side, squared, that a triangle's area has to exceed.
constexpr double kSliver = 1e-6;

using Loop = std::vector<std::uint32_t>;

// Edges that wait for a face, as seen from both ends.
class OpenEdges {
 public:
  struct Step {
    std::uint32_t to;
    bool forward;  // the other way than the face that is there goes, as its neighbour should
  };
  explicit OpenEdges(std::span<const Triangle> triangles) {
    for_each_edge(sorted_sides(triangles), [&](std::span<const Side> edge) {
      if (edge.size() != 1) return;
      const auto [low, high, corner, forward] = edge.front();
      const std::uint32_t from = forward ? high : low, to = forward ? low : high;
      if (steps_[from].empty()) starts_.push_back(from);
      steps_[from].push_back({to, true});
      steps_[to].push_back({from, false});
    });
  }
  const std::vector<std::uint32_t>& starts() const { return starts_; }
  bool leads_on(std::uint32_t vertex) const {
    const auto found = steps_.find(vertex);
    return found != steps_.end() && !found->second.empty();
  }
  /// Backward only where there is no way forward: beside a face that is the wrong way round.
  Step take(std::uint32_t vertex) {
    std::vector<Step>& steps = steps_[vertex];
    auto chosen = std::ranges::find_if(steps, &Step::forward);
    if (chosen == steps.end()) --chosen;
    const Step step = *chosen;
    steps.erase(chosen);
    std::vector<Step>& other = steps_[step.to];
    other.erase(std::ranges::find_if(
        other, [&](const Step& back) { return back.to == vertex && back.forward != step.forward; }));
    return step;
  }

 private:
  std::unordered_map<std::uint32_t, std::vector<Step>> steps_;
  std::vector<std::uint32_t> starts_;
};

// Loops that visit no vertex twice, the way round that most faces beside them want; counts edges that are in
// none.
std::vector<Loop> find_loops(std::span<const Triangle> triangles, std::size_t& left) {
  OpenEdges edges(triangles);
  std::vector<Loop> loops;
  Loop path;
  std::vector<bool> forward;  // by edge of the path
  std::unordered_map<std::uint32_t, std::size_t> places;
  for (const std::uint32_t start : edges.starts())
    while (edges.leads_on(start)) {
      path.assign(1, start);
      forward.clear();
      places = {{start, 0}};
      while (edges.leads_on(path.back())) {
        const OpenEdges::Step step = edges.take(path.back());
        forward.push_back(step.forward);
        const auto [found, is_new] = places.try_emplace(step.to, path.size());
        if (is_new) {
          path.push_back(step.to);
          continue;
        }
        const auto first = static_cast<std::ptrdiff_t>(found->second);
        const auto begin = path.begin() + first;
        Loop& loop = loops.emplace_back(begin, path.end());
        const auto right = std::count(forward.begin() + first, forward.end(), true);
        if (2 * static_cast<std::size_t>(right) < loop.size()) std::ranges::reverse(loop);
        for (auto vertex = begin + 1; vertex != path.end(); ++vertex) places.erase(*vertex);
        path.erase(begin + 1, path.end());
        forward.erase(forward.begin() + first, forward.end());
      }
      left += path.size() - 1;
    }
  return loops;
}

// Edges that there are already. A triangle across two sides of a face that sticks out into a hole would lie
// on that face.
class TakenEdges {
 public:
  void add(std::span<const Triangle> triangles) {
    for (const Triangle& t : triangles)
      for (std::size_t i = 0; i < 3; ++i) edges_.insert(key(t[i], t[(i + 1) % 3]));
  }
  bool contain(std::uint32_t a, std::uint32_t b) const { return edges_.contains(key(a, b)); }

 private:
  static std::uint64_t key(std::uint32_t a, std::uint32_t b) {
    return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
  }
  std::unordered_set<std::uint64_t> edges_;
};

// Twice the area, and a little for a triangle that has none: along a straight border they come for free.
double triangle_cost(const std::vector<Vec3>& positions, const Triangle& t, double little) {
  const Vec3d a(positions[t[0]]), ab = Vec3d(positions[t[1]]) - a, ac = Vec3d(positions[t[2]]) - a;
  const double area = ab.cross(ac).length();
  return area > kSliver * std::max({ab.length2(), ac.length2(), (ac - ab).length2()}) ? area : area + little;
}

// Triangles over a loop that have the least area together, across as few edges that are taken as can be.
void triangulate(const Loop& loop, const std::vector<Vec3>& positions, const TakenEdges& taken,
                 std::vector<Triangle>& triangles) {
  const std::size_t n = loop.size();
  double length = 0;
  for (std::size_t i = 0; i < n; ++i)
    length += (Vec3d(positions[loop[(i + 1) % n]]) - Vec3d(positions[loop[i]])).length();
  const double little = kSliver * square(length);
  const double much = square(length);     // more than any triangle over it has
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
      // All but the side that closes the loop runs across it.
      const bool across = span + 1 < n;
      least[i * n + k] = best + (across && taken.contain(loop[i], loop[k]) ? much : 0);
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
void triangulate_coarsely(const Loop& loop, const std::vector<Vec3>& positions, const TakenEdges& taken,
                          std::vector<Triangle>& triangles) {
  const std::size_t step = (loop.size() + kMostEdges - 1) / kMostEdges;
  Loop coarse;
  for (std::size_t begin = 0; begin < loop.size(); begin += step) {
    coarse.push_back(loop[begin]);
    Loop chain;
    for (std::size_t i = begin; i <= std::min(begin + step, loop.size()); ++i)
      chain.push_back(loop[i % loop.size()]);
    if (chain.size() > 2) triangulate(chain, positions, taken, triangles);
  }
  triangulate(coarse, positions, taken, triangles);
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
  const std::vector<Triangle> triangles = welded_triangles(mesh);
  const std::vector<Loop> loops = find_loops(triangles, left);
  TakenEdges taken;
  if (!loops.empty()) taken.add(triangles);
  for (const Loop& loop : loops) {
    std::vector<Triangle> patch;
    triangulate_coarsely(loop, mesh.positions, taken, patch);
    taken.add(patch);
    add_patch(mesh, std::move(patch));
  }
  if (left > 0)
    warnings.push_back(
        fmt::format("{}: {} boundary edges form no loop, beside edges of more than two faces, and stay open",
                    place, left));
  return loops.size();
}

}  // namespace nacre
