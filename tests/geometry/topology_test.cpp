// label: unit
#include "nacre/geometry/topology.h"

#include <gtest/gtest.h>

#include "nacre/geometry/primitives.h"

namespace nacre {
namespace {

Mesh make_tetrahedron(const Vec3& origin = Vec3(0)) {
  Mesh mesh;
  mesh.positions = {origin, origin + Vec3(1, 0, 0), origin + Vec3(0, 1, 0), origin + Vec3(0, 0, 1)};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return mesh;
}

void append(Mesh& mesh, const Mesh& other) {
  const auto base = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
  for (const Triangle& t : other.triangles) mesh.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
}

TEST(Topology, SoundMesh) {
  const TopologyReport report = analyse_topology(make_tetrahedron());
  EXPECT_EQ(report.vertices, 4u);
  EXPECT_EQ(report.triangles, 4u);
  EXPECT_EQ(report.components, 1u);
  EXPECT_TRUE(report.closed());
  EXPECT_EQ(report.openmesh_added_vertices, 0u);
  EXPECT_NEAR(report.volume, 1.0 / 6, 1e-12);
  EXPECT_NEAR(report.area, 1.5 + std::sqrt(3.0) / 2, 1e-7);
  EXPECT_EQ(report.box.max, Vec3(1));
  EXPECT_EQ(describe_problems(report), "");
}

TEST(Topology, EmptyMesh) {
  const TopologyReport report = analyse_topology(Mesh());
  EXPECT_EQ(report.components, 0u);
  EXPECT_EQ(report.boundary_loops, 0u);
  EXPECT_TRUE(report.box.isEmpty());
}

TEST(Topology, HolesAndComponents) {
  Mesh mesh = make_tetrahedron();
  append(mesh, make_tetrahedron(Vec3(5)));
  append(mesh, make_tetrahedron(Vec3(9)));
  mesh.triangles.erase(mesh.triangles.begin() + 7);
  mesh.triangles.erase(mesh.triangles.begin());
  const TopologyReport report = analyse_topology(mesh);
  EXPECT_EQ(report.components, 3u);
  EXPECT_EQ(report.boundary_edges, 6u);
  EXPECT_EQ(report.boundary_loops, 2u);
  EXPECT_FALSE(report.closed());
  EXPECT_EQ(describe_problems(report), "open: 2 boundary loops of 6 edges");
}

TEST(Topology, VerticesAtOnePositionAreOne) {
  Mesh soup;  // as STL files are
  const Mesh tetrahedron = make_tetrahedron();
  for (const Triangle& t : tetrahedron.triangles) {
    const auto base = static_cast<std::uint32_t>(soup.positions.size());
    for (const std::uint32_t v : t) soup.positions.push_back(tetrahedron.positions[v]);
    soup.triangles.push_back({base, base + 1, base + 2});
  }
  const TopologyReport report = analyse_topology(soup);
  EXPECT_EQ(report.vertices, 4u);
  EXPECT_TRUE(report.closed());
}

TEST(Topology, FinMakesEdgeNonManifold) {
  Mesh mesh = make_tetrahedron();
  mesh.positions.emplace_back(1.0f, -1.0f, 0.0f);
  mesh.triangles.push_back({0, 1, 4});
  const TopologyReport report = analyse_topology(mesh);
  EXPECT_EQ(report.non_manifold_edges, 1u);
  EXPECT_EQ(report.boundary_edges, 2u);
  EXPECT_EQ(report.boundary_loops, 1u);
  EXPECT_EQ(report.components, 1u);
  EXPECT_EQ(report.openmesh_added_vertices, 2u);  // the fin's own copies of the edge's ends
  EXPECT_NE(describe_problems(report).find("1 edge with more than two faces"), std::string::npos);
}

TEST(Topology, CubesThatTouch) {
  // Two tetrahedra that share a vertex only, then an edge only.
  Mesh by_vertex = make_tetrahedron(), mirrored = make_tetrahedron();
  for (Vec3& p : mirrored.positions) p = -p;
  flip_normals(mirrored);
  append(by_vertex, mirrored);
  const TopologyReport vertex = analyse_topology(by_vertex);
  EXPECT_TRUE(vertex.closed());
  EXPECT_EQ(vertex.components, 2u);
  EXPECT_EQ(vertex.openmesh_added_vertices, 1u);

  Mesh by_edge = make_tetrahedron(), turned = make_tetrahedron();
  for (Vec3& p : turned.positions) p = Vec3(-p.x, -p.y, p.z);
  append(by_edge, turned);
  const TopologyReport edge = analyse_topology(by_edge);
  EXPECT_EQ(edge.non_manifold_edges, 1u);
  EXPECT_EQ(edge.boundary_edges, 0u);
  EXPECT_FALSE(edge.closed());
  EXPECT_EQ(edge.openmesh_added_vertices, 2u);
}

TEST(Topology, FlippedFaces) {
  Mesh mesh = make_tetrahedron();
  std::swap(mesh.triangles[3][0], mesh.triangles[3][1]);
  const TopologyReport report = analyse_topology(mesh);
  EXPECT_EQ(report.flipped_edges, 3u);
  EXPECT_EQ(report.boundary_edges, 0u);
  EXPECT_EQ(report.openmesh_added_vertices, 3u);
  EXPECT_NE(describe_problems(report).find("3 edges between faces of opposite orientation"),
            std::string::npos);
}

TEST(Topology, MoebiusStripHasOneBoundary) {
  Mesh strip;
  constexpr std::uint32_t kCount = 12;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const float phi = 2 * kPi * static_cast<float>(i) / kCount;
    const Vec3 centre(3 * std::cos(phi), 3 * std::sin(phi), 0);
    const Vec3 across(std::cos(phi) * std::cos(phi / 2), std::sin(phi) * std::cos(phi / 2),
                      std::sin(phi / 2));
    strip.positions.push_back(centre + across);
    strip.positions.push_back(centre - across);
  }
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const bool last = i + 1 == kCount;
    const std::uint32_t a = 2 * i, b = 2 * i + 1, c = last ? 1 : a + 2, d = last ? 0 : a + 3;
    strip.triangles.push_back({a, b, c});
    strip.triangles.push_back({c, b, d});
  }
  const TopologyReport report = analyse_topology(strip);
  EXPECT_EQ(report.boundary_loops, 1u);
  EXPECT_EQ(report.boundary_edges, 2 * kCount);
  EXPECT_EQ(report.flipped_edges, 1u);
  EXPECT_EQ(report.openmesh_added_vertices, 2u);
}

TEST(Topology, DegenerateAndDuplicateFaces) {
  Mesh mesh = make_tetrahedron();
  mesh.positions.emplace_back(2.0f, 0.0f, 0.0f);
  mesh.positions.emplace_back(0.0f, 0.0f, 0.0f);
  mesh.triangles.push_back({0, 5, 1});  // two vertices at one position
  mesh.triangles.push_back({2, 2, 1});
  const TopologyReport closed = analyse_topology(mesh);
  EXPECT_EQ(closed.degenerate_triangles, 2u);
  EXPECT_TRUE(closed.closed());
  mesh.triangles.push_back({0, 1, 4});  // on a line
  mesh.triangles.push_back({3, 2, 1});
  mesh.triangles.push_back({2, 3, 1});
  const TopologyReport report = analyse_topology(mesh);
  EXPECT_EQ(report.triangles, 9u);
  EXPECT_EQ(report.degenerate_triangles, 3u);
  EXPECT_EQ(report.duplicate_faces, 2u);
  EXPECT_NE(describe_problems(report).find("3 degenerate triangles"), std::string::npos);
}

TEST(Topology, InsideOut) {
  Mesh mesh = make_sphere();
  flip_normals(mesh);
  EXPECT_EQ(describe_problems(analyse_topology(mesh)), "inside-out: faces point inward, flip the normals");
}

}  // namespace
}  // namespace nacre
