// Counts over edges. A half-edge mesh is of no help here: it cannot hold what the report is to find.
#include "nacre/geometry/topology.h"

#include <algorithm>

#include "geometry/edge_table.h"
#include "nacre/base/error.h"
#include "nacre/base/parallel.h"

namespace nacre {
namespace {

std::uint64_t count_sets(DisjointSets& sets, const std::vector<bool>& members) {
  std::uint64_t count = 0;
  for (std::uint32_t i = 0; i < members.size(); ++i)
    if (members[i] && sets.find(i) == i) ++count;
  return count;
}

std::uint64_t count_duplicates(std::vector<Triangle> triangles) {
  for (Triangle& t : triangles) std::sort(t.begin(), t.end());
  parallel_sort(triangles.begin(), triangles.end(), std::less<>());
  std::uint64_t count = 0;
  for (std::size_t i = 1; i < triangles.size(); ++i)
    if (triangles[i] == triangles[i - 1]) ++count;
  return count;
}

}  // namespace

TopologyReport analyse_topology(const Mesh& mesh) {
  TopologyReport report;
  report.triangles = mesh.triangles.size();
  report.area = surface_area(mesh);
  report.volume = signed_volume(mesh);
  report.box = bounds(mesh);

  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    report.area_vector += Vec3d(area_vector(mesh, i)) / 2;

  const std::vector<Triangle> triangles = welded_triangles(mesh);
  report.degenerate_triangles = mesh.triangles.size() - triangles.size();
  for (const Triangle& t : triangles) {
    const Vec3d a(mesh.positions[t[0]]);
    if ((Vec3d(mesh.positions[t[1]]) - a).cross(Vec3d(mesh.positions[t[2]]) - a) == Vec3d(0))
      ++report.degenerate_triangles;
  }
  report.duplicate_faces = count_duplicates(triangles);

  const std::vector<Side> sides = sorted_sides(triangles);
  DisjointSets faces(triangles.size()), borders(mesh.positions.size());
  std::vector<bool> on_border(mesh.positions.size(), false), used(mesh.positions.size(), false);
  for_each_edge(sides, [&](std::span<const Side> edge) {
    const Side& first = edge.front();
    used[first.low] = used[first.high] = true;
    for (const Side& other : edge.subspan(1)) faces.unite(first.corner / 3, other.corner / 3);
    if (edge.size() == 1) {
      ++report.boundary_edges;
      on_border[first.low] = on_border[first.high] = true;
      borders.unite(first.low, first.high);
    } else if (edge.size() > 2) {
      ++report.non_manifold_edges;
    } else if (!is_regular(edge)) {
      ++report.flipped_edges;
    }
  });
  report.vertices = static_cast<std::uint64_t>(std::count(used.begin(), used.end(), true));
  report.components = count_sets(faces, std::vector<bool>(triangles.size(), true));
  report.boundary_loops = count_sets(borders, on_border);
  report.openmesh_added_vertices = cut_to_manifold(triangles, sides).origins.size() - report.vertices;
  return report;
}

std::string describe_problems(const TopologyReport& report) {
  std::string text;
  const auto say = [&](const std::string& problem) {
    if (!text.empty()) text += "; ";
    text += problem;
  };
  const auto count = [](std::uint64_t n, const char* one, const char* many) {
    return fmt::format("{} {}", n, n == 1 ? one : many);
  };
  if (report.boundary_edges > 0)
    say(fmt::format("open: {} of {}", count(report.boundary_loops, "boundary loop", "boundary loops"),
                    count(report.boundary_edges, "edge", "edges")));
  if (report.non_manifold_edges > 0)
    say(count(report.non_manifold_edges, "edge", "edges") + " with more than two faces");
  if (report.flipped_edges > 0)
    say(count(report.flipped_edges, "edge", "edges") + " between faces of opposite orientation");
  if (report.duplicate_faces > 0) say(count(report.duplicate_faces, "duplicate face", "duplicate faces"));
  if (report.degenerate_triangles > 0)
    say(count(report.degenerate_triangles, "degenerate triangle", "degenerate triangles"));
  if (report.closed() && report.flipped_edges == 0 && report.volume < 0)
    say("inside-out: faces point inward, flip the normals");
  return text;
}

std::string advise_on_borders(const TopologyReport& report) {
  if (report.boundary_edges == 0) return "";
  return report.is_sheet() ? "; a sheet is lit and seen as a half-space: give it thickness if it is thin"
                           : "; fillHoles closes holes";
}

}  // namespace nacre
