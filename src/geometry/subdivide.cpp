// Loop subdivision: OpenMesh refines, then every vertex moves to where infinitely many levels would take it.
#include "nacre/geometry/subdivide.h"

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Subdivider/Uniform/LoopT.hh>
#include <algorithm>

#include "geometry/edge_table.h"
#include "geometry/quiet_openmesh.h"
#include "nacre/base/parallel.h"

namespace nacre {
namespace {

constexpr std::uint64_t kMaxTriangles = 50'000'000;
// OpenMesh walks around both vertices of every edge that it adds.
constexpr std::uint32_t kMaxValence = 4096;

struct DoubleTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
};
using HalfedgeMesh = OpenMesh::TriMesh_ArrayKernelT<DoubleTraits>;
using Subdivider = OpenMesh::Subdivider::Uniform::LoopT<HalfedgeMesh, double>;

Vec3d to_vec3d(const OpenMesh::Vec3d& p) { return {p[0], p[1], p[2]}; }

// Each triangle once, those with the same orientation over the same vertices being the same.
void drop_duplicates(std::vector<Triangle>& triangles) {
  for (Triangle& t : triangles) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  parallel_sort(triangles.begin(), triangles.end(), std::less<>());
  triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
}

std::uint32_t largest_valence(const ManifoldCut& cut) {
  std::vector<std::uint32_t> faces(cut.origins.size(), 0);
  for (const Triangle& t : cut.triangles)
    for (const std::uint32_t v : t) ++faces[v];
  return *std::max_element(faces.begin(), faces.end()) + 1;  // an open fan has one more edge than faces
}

// Returns the number of faces that OpenMesh did not take until they had vertices of their own: those around
// an edge to which the surface comes back, which no cut along it separates.
std::uint64_t build(HalfedgeMesh& halfedges, const ManifoldCut& cut, const std::vector<Vec3>& positions) {
  const QuietOpenMesh quiet;
  halfedges.reserve(cut.origins.size(), cut.origins.size() + cut.triangles.size(), cut.triangles.size());
  const auto add_vertex = [&](std::uint32_t copy) {
    const Vec3& p = positions[cut.origins[copy]];
    return halfedges.add_vertex(OpenMesh::Vec3d(p.x, p.y, p.z));
  };
  for (std::uint32_t v = 0; v < cut.origins.size(); ++v) add_vertex(v);
  std::uint64_t refused = 0;
  for (const auto& [a, b, c] : cut.triangles) {
    const auto handle = [](std::uint32_t v) { return OpenMesh::VertexHandle(static_cast<int>(v)); };
    if (halfedges.add_face(handle(a), handle(b), handle(c)).is_valid()) continue;
    const auto own_a = add_vertex(a), own_b = add_vertex(b), own_c = add_vertex(c);
    halfedges.add_face(own_a, own_b, own_c);
    ++refused;
  }
  return refused;
}

struct LimitPoint {
  Vec3d position;
  Vec3d normal;  // any length; zero on borders
};

// Where subdivision takes a vertex in the end, and the surface's normal there. Source: Loop 1987; Hoppe et
// al. 1994, "Piecewise smooth surface reconstruction", appendix.
LimitPoint limit_point(const HalfedgeMesh& mesh, HalfedgeMesh::VertexHandle vertex) {
  const Vec3d p = to_vec3d(mesh.point(vertex));
  if (mesh.is_boundary(vertex)) {
    const auto out = mesh.halfedge_handle(vertex);  // OpenMesh keeps this one on the border
    const Vec3d next = to_vec3d(mesh.point(mesh.to_vertex_handle(out)));
    const Vec3d previous = to_vec3d(mesh.point(mesh.from_vertex_handle(mesh.prev_halfedge_handle(out))));
    return {(next + p * 4.0 + previous) / 6.0, Vec3d(0)};
  }
  const double valence = mesh.valence(vertex);
  Vec3d sum(0), s(0), t(0);
  double i = 0;
  for (auto ring = mesh.cvv_ccwiter(vertex); ring.is_valid(); ++ring, ++i) {
    const Vec3d q = to_vec3d(mesh.point(*ring));
    sum += q;
    s += (q - p) * std::cos(2 * kPiD * i / valence);
    t += (q - p) * std::sin(2 * kPiD * i / valence);
  }
  const double beta = (0.625 - square(0.375 + 0.25 * std::cos(2 * kPiD / valence))) / valence;
  const double weight = 3.0 / (8.0 * beta);
  return {(p * weight + sum) / (weight + valence), s.cross(t)};
}

Mesh take_limit_surface(const HalfedgeMesh& halfedges) {
  Mesh mesh;
  mesh.positions.resize(halfedges.n_vertices(), Vec3(0));
  std::vector<Vec3> limit_normals(halfedges.n_vertices(), Vec3(0));
  parallel_for(halfedges.n_vertices(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const OpenMesh::VertexHandle vertex(static_cast<int>(i));
      if (halfedges.is_isolated(vertex)) continue;
      const LimitPoint limit = limit_point(halfedges, vertex);
      mesh.positions[i] = Vec3(limit.position);
      limit_normals[i] = Vec3(limit.normal.normalized());
    }
  });
  mesh.triangles.reserve(halfedges.n_faces());
  for (const auto face : halfedges.faces()) {
    Triangle t;
    std::size_t k = 0;
    for (auto corner = halfedges.cfv_ccwiter(face); corner.is_valid() && k < 3; ++corner)
      t[k++] = static_cast<std::uint32_t>(corner->idx());
    mesh.triangles.push_back(t);
  }
  // On borders, and where the tangents vanish, the average over the faces has to do.
  compute_normals(mesh, 180);
  for (std::size_t i = 0; i < limit_normals.size(); ++i)
    if (limit_normals[i] != Vec3(0)) mesh.normals[i] = limit_normals[i];
  return mesh;
}

}  // namespace

Mesh subdivide_loop(const Mesh& mesh, int levels, const std::string& place, Warnings& warnings) {
  if (levels < 0)
    fail(ErrorCode::kValue, place, "the number of subdivisions is {}, but has to be 0 or more", levels);
  std::vector<Triangle> triangles = welded_triangles(mesh);
  if (triangles.empty()) fail(ErrorCode::kValue, place, "nothing to subdivide: all triangles are degenerate");
  drop_duplicates(triangles);
  std::uint64_t count = triangles.size();
  for (int level = 0; level < levels && count <= kMaxTriangles; ++level) count *= 4;
  if (count > kMaxTriangles)
    fail(ErrorCode::kLimit, place,
         "{} subdivisions of {} triangles would give more than {} million: use fewer", levels,
         triangles.size(), kMaxTriangles / 1'000'000);

  const ManifoldCut cut = cut_to_manifold(triangles, sorted_sides(triangles));
  const std::uint32_t valence = largest_valence(cut);
  if (valence > kMaxValence)
    fail(ErrorCode::kLimit, place, "cannot subdivide a mesh with {} edges at one vertex: at most {}", valence,
         kMaxValence);
  HalfedgeMesh halfedges;
  const std::uint64_t refused = build(halfedges, cut, mesh.positions);
  std::vector<std::uint32_t> sources = cut.origins;
  std::sort(sources.begin(), sources.end());
  const auto distinct = std::unique(sources.begin(), sources.end()) - sources.begin();
  const std::uint64_t copied = cut.origins.size() - static_cast<std::uint64_t>(distinct) + 3 * refused;
  if (copied > 0)
    warnings.push_back(fmt::format(
        "{}: not an oriented manifold: subdivision opened it up at {} vertices, where seams may show", place,
        copied));

  Subdivider subdivider;
  subdivider.init_weights(std::max(valence, 6u) + 1);  // it looks weights up by valence, unchecked
  subdivider.attach(halfedges);
  subdivider(static_cast<std::size_t>(levels));
  subdivider.detach();
  return take_limit_surface(halfedges);
}

}  // namespace nacre
