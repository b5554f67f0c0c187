// Checks, triangulates, and splits vertices where attributes differ.
#include "geometry/raw_mesh.h"

#include <algorithm>
#include <array>
#include <bit>
#include <unordered_map>

#include "geometry/polygon.h"
#include "nacre/base/random.h"

namespace nacre {
namespace {

void check_values(RawMesh& raw, const std::string& path) {
  for (std::size_t i = 0; i < raw.positions.size(); ++i)
    if (!is_finite(raw.positions[i]))
      fail(ErrorCode::kValue, path, "vertex {}: a coordinate is not a finite number", i);
  for (const std::uint32_t corner : raw.corners)
    if (corner >= raw.positions.size())
      fail(ErrorCode::kSyntax, path, "a face uses vertex {} of {}", static_cast<std::int32_t>(corner),
           raw.positions.size());
  // Attributes are no reason to refuse a mesh. Normals that are unit vectors up to rounding keep their bits.
  for (Vec3& n : raw.normals) {
    if (!is_finite(n)) n = Vec3(0);
    if (!(std::abs(n.length2() - 1) < 1e-6f)) n.normalize();
  }
  for (Vec2& uv : raw.uvs)
    if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) uv = Vec2(0);
}

// Triangles as indices into raw.corners. Returns the number of faces of which nothing is left.
std::uint64_t triangulate(const RawMesh& raw, std::vector<std::array<std::size_t, 3>>& triangles) {
  std::uint64_t dropped = 0;
  std::vector<Vec3> points;
  std::vector<Triangle> pieces;
  std::size_t begin = 0;
  for (const std::size_t end : raw.face_ends) {
    points.clear();
    pieces.clear();
    for (std::size_t i = begin; i < end; ++i) points.push_back(raw.positions[raw.corners[i]]);
    triangulate_polygon(points, pieces);
    bool any = false;
    for (const Triangle& piece : pieces) {
      const std::array<std::size_t, 3> t = {begin + piece[0], begin + piece[1], begin + piece[2]};
      const std::uint32_t a = raw.corners[t[0]], b = raw.corners[t[1]], c = raw.corners[t[2]];
      if (a == b || b == c || c == a) continue;
      triangles.push_back(t);
      any = true;
    }
    if (!any) ++dropped;
    begin = end;
  }
  return dropped;
}

// What makes a vertex of the mesh: a position of the file and, where they vary by corner, the attributes.
struct VertexKey {
  std::uint32_t position = 0;
  std::array<float, 5> attributes{};  // normal, texture coordinates
  bool operator==(const VertexKey&) const = default;
};
struct HashVertexKey {
  std::size_t operator()(const VertexKey& key) const {
    const auto bits = [&](std::size_t i) {
      return std::uint64_t{std::bit_cast<std::uint32_t>(key.attributes[i] == 0 ? 0.0f : key.attributes[i])};
    };
    return hash_words(key.position, bits(0) << 32 | bits(1), bits(2) << 32 | bits(3), bits(4));
  }
};

// Gives each vertex without a normal the average over its faces.
void fill_missing_normals(Mesh& mesh) {
  std::vector<Vec3d> sums;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (const std::uint32_t v : mesh.triangles[i])
      if (mesh.normals[v] == Vec3(0)) {
        sums.resize(mesh.positions.size(), Vec3d(0));
        sums[v] += Vec3d(area_vector(mesh, i));
      }
  for (std::size_t v = 0; v < sums.size(); ++v)
    if (mesh.normals[v] == Vec3(0))
      mesh.normals[v] = sums[v] == Vec3d(0) ? Vec3(0, 0, 1) : Vec3(sums[v].normalized());
}

Mesh assemble(const RawMesh& raw, const std::vector<std::array<std::size_t, 3>>& triangles) {
  Mesh mesh;
  mesh.triangles.reserve(triangles.size());
  const auto add_vertex = [&](std::uint32_t position, std::size_t attribute) {
    mesh.positions.push_back(raw.positions[position]);
    if (!raw.normals.empty()) mesh.normals.push_back(raw.normals[attribute]);
    if (!raw.uvs.empty()) mesh.uvs.push_back(raw.uvs[attribute]);
    return static_cast<std::uint32_t>(mesh.positions.size() - 1);
  };
  const bool split = raw.attributes_by_corner && !(raw.normals.empty() && raw.uvs.empty());
  std::unordered_map<VertexKey, std::uint32_t, HashVertexKey> by_key;
  std::vector<std::uint32_t> by_position;
  if (!split) {
    // In the order of the file, without those that are not used.
    by_position.assign(raw.positions.size(), 0);
    for (const auto& triangle : triangles)
      for (const std::size_t corner : triangle) by_position[raw.corners[corner]] = 1;
    for (std::uint32_t i = 0; i < raw.positions.size(); ++i)
      if (by_position[i] != 0) by_position[i] = add_vertex(i, i);
  }
  const auto vertex_of = [&](std::size_t corner) {
    const std::uint32_t position = raw.corners[corner];
    if (!split) return by_position[position];
    const Vec3 n = raw.normals.empty() ? Vec3(0) : raw.normals[corner];
    const Vec2 uv = raw.uvs.empty() ? Vec2(0) : raw.uvs[corner];
    const auto [entry, is_new] = by_key.try_emplace(VertexKey{position, {n.x, n.y, n.z, uv.x, uv.y}});
    if (is_new) entry->second = add_vertex(position, corner);
    return entry->second;
  };
  for (const auto& [a, b, c] : triangles) {
    const std::uint32_t va = vertex_of(a), vb = vertex_of(b), vc = vertex_of(c);
    mesh.triangles.push_back({va, vb, vc});
  }
  if (!mesh.normals.empty()) fill_missing_normals(mesh);
  return mesh;
}

std::uint64_t count_unused_positions(const RawMesh& raw) {
  std::vector<bool> used(raw.positions.size(), false);
  for (const std::uint32_t corner : raw.corners) used[corner] = true;
  return static_cast<std::uint64_t>(std::count(used.begin(), used.end(), false));
}

}  // namespace

Mesh assemble_mesh(RawMesh raw, std::uint64_t dropped_faces, const std::string& path, Warnings& warnings) {
  check_values(raw, path);
  std::vector<std::array<std::size_t, 3>> triangles;
  const std::uint64_t dropped = triangulate(raw, triangles) + dropped_faces;
  if (triangles.empty()) fail(ErrorCode::kValue, path, "there is no triangle in the file");
  const std::uint64_t unused = count_unused_positions(raw);
  std::string left_out;
  if (dropped > 0) left_out = fmt::format("degenerate faces: {}", dropped);
  if (unused > 0) left_out += fmt::format("{}vertices that no face uses: {}", dropped ? ", " : "", unused);
  if (!left_out.empty()) warnings.push_back(fmt::format("{}: left out {}", path, left_out));
  return assemble(raw, triangles);
}

}  // namespace nacre
