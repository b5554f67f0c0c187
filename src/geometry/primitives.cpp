// Sphere, rectangle, cube, disk and cylinder as triangle meshes.
#include "nacre/geometry/primitives.h"

#include <map>
#include <set>

#include "nacre/base/error.h"

namespace nacre {
namespace {

constexpr int kSphereLevels = 6;         // 20 * 4^6 triangles
constexpr std::uint32_t kSectors = 256;  // of disk and cylinder: the outline deviates by 8e-5 of the radius

Vec2 circle_point(std::uint32_t sector) {
  const double phi = 2 * kPiD * (sector % kSectors) / kSectors;
  return {static_cast<float>(std::cos(phi)), static_cast<float>(std::sin(phi))};
}

struct Icosphere {
  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;
};

Icosphere make_icosahedron() {
  const double a = std::numbers::phi;
  Icosphere s;
  s.points = {{-1, a, 0},  {1, a, 0},  {-1, -a, 0}, {1, -a, 0}, {0, -1, a},  {0, 1, a},
              {0, -1, -a}, {0, 1, -a}, {a, 0, -1},  {a, 0, 1},  {-a, 0, -1}, {-a, 0, 1}};
  for (Vec3d& p : s.points) p.normalize();
  s.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                 {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                 {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  return s;
}

void refine(Icosphere& s) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> midpoints;
  const auto midpoint = [&](std::uint32_t a, std::uint32_t b) {
    const auto [entry, is_new] =
        midpoints.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(s.points.size()));
    if (is_new) {
      const Vec3d middle = s.points[a] + s.points[b];
      s.points.push_back(middle.normalized());
    }
    return entry->second;
  };
  std::vector<Triangle> finer;
  finer.reserve(4 * s.triangles.size());
  for (const auto& [a, b, c] : s.triangles) {
    const std::uint32_t ab = midpoint(a, b), bc = midpoint(b, c), ca = midpoint(c, a);
    finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
  }
  s.triangles = std::move(finer);
}

}  // namespace

Mesh make_sphere() {
  Icosphere sphere = make_icosahedron();
  for (int level = 0; level < kSphereLevels; ++level) refine(sphere);

  Mesh mesh;
  mesh.triangles = std::move(sphere.triangles);
  for (const Vec3d& p : sphere.points) {
    double phi = std::atan2(p.y, p.x);
    if (phi < 0) phi += 2 * kPiD;
    mesh.positions.emplace_back(p);
    // Upright: v = 0 is the bottom of a picture, and the south pole.
    mesh.uvs.emplace_back(static_cast<float>(phi / (2 * kPiD)),
                          1 - static_cast<float>(std::acos(std::clamp(p.z, -1.0, 1.0)) / kPiD));
  }
  // u jumps from 1 to 0 at phi = 0 and is undefined at the poles: the triangles there get vertices of their
  // own, so that u runs on beyond 1 and every triangle at a pole has the u of its middle there.
  std::map<std::uint32_t, std::uint32_t> beyond_seam;
  std::set<std::uint32_t> taken_poles;
  const auto add_copy = [&](std::uint32_t v, float u) {
    const Vec3 position = mesh.positions[v];
    mesh.positions.push_back(position);
    mesh.uvs.emplace_back(u, mesh.uvs[v].y);
    return static_cast<std::uint32_t>(mesh.positions.size() - 1);
  };
  const auto is_pole = [&](std::uint32_t v) {
    return std::hypot(mesh.positions[v].x, mesh.positions[v].y) < 1e-6f;
  };
  for (Triangle& t : mesh.triangles) {
    float largest = 0;
    for (const std::uint32_t v : t)
      if (!is_pole(v)) largest = std::max(largest, mesh.uvs[v].x);
    for (std::uint32_t& v : t) {
      if (is_pole(v) || mesh.uvs[v].x > largest - 0.5f) continue;
      const auto [copy, is_new] = beyond_seam.try_emplace(v);
      if (is_new) copy->second = add_copy(v, mesh.uvs[v].x + 1);
      v = copy->second;
    }
    float sum = 0;
    for (const std::uint32_t v : t)
      if (!is_pole(v)) sum += mesh.uvs[v].x;
    for (std::uint32_t& v : t) {
      if (!is_pole(v)) continue;
      if (taken_poles.insert(v).second)
        mesh.uvs[v].x = 0.5f * sum;
      else
        v = add_copy(v, 0.5f * sum);
    }
  }
  mesh.normals = mesh.positions;
  for (Vec3& n : mesh.normals) n.normalize();
  return mesh;
}

Mesh make_rectangle() {
  Mesh mesh;
  mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  mesh.normals.assign(4, Vec3(0, 0, 1));
  mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  mesh.triangles = {{0, 1, 2}, {2, 3, 0}};
  return mesh;
}

Mesh make_cube() {
  // For each face its normal and the direction of u, those of Mitsuba; v grows along normal x u, so that
  // pictures, whose v = 0 is at the bottom here, are not mirrored.
  struct Face {
    Vec3 normal, u;
  };
  const Face faces[] = {{{0, -1, 0}, {0, 0, 1}}, {{0, 1, 0}, {-1, 0, 0}}, {{1, 0, 0}, {0, 1, 0}},
                        {{0, 0, 1}, {0, 1, 0}},  {{-1, 0, 0}, {0, 1, 0}}, {{0, 0, -1}, {0, -1, 0}}};
  Mesh mesh;
  for (const Face& face : faces) {
    const auto base = static_cast<std::uint32_t>(mesh.positions.size());
    for (const Vec2& uv : {Vec2(0, 0), Vec2(1, 0), Vec2(1, 1), Vec2(0, 1)}) {
      mesh.positions.push_back(face.normal + face.u * (2 * uv.x - 1) +
                               cross(face.normal, face.u) * (2 * uv.y - 1));
      mesh.normals.push_back(face.normal);
      mesh.uvs.push_back(uv);
    }
    mesh.triangles.push_back({base, base + 1, base + 2});
    mesh.triangles.push_back({base, base + 2, base + 3});
  }
  return mesh;
}

Mesh make_disk() {
  // Polar coordinates (r, phi / 2 pi). Every sector has its own centre vertex, which carries its phi.
  Mesh mesh;
  for (std::uint32_t i = 0; i <= kSectors; ++i) {
    const Vec2 p = circle_point(i);
    mesh.positions.emplace_back(p.x, p.y, 0.0f);
    mesh.uvs.emplace_back(1.0f, static_cast<float>(i) / kSectors);
  }
  for (std::uint32_t i = 0; i < kSectors; ++i) {
    mesh.triangles.push_back({static_cast<std::uint32_t>(mesh.positions.size()), i, i + 1});
    mesh.positions.emplace_back(0.0f);
    mesh.uvs.emplace_back(0.0f, (static_cast<float>(i) + 0.5f) / kSectors);
  }
  mesh.normals.assign(mesh.positions.size(), Vec3(0, 0, 1));
  return mesh;
}

Mesh make_cylinder(const Vec3& p0, const Vec3& p1, float radius, const std::string& place) {
  if (!is_finite(p0) || !is_finite(p1)) fail(ErrorCode::kValue, place, "p0 and p1 have to be finite");
  if (!(radius > 0) || !std::isfinite(radius))
    fail(ErrorCode::kValue, place, "the radius of a cylinder has to be a positive number, not {}", radius);
  const Vec3d axis = Vec3d(p1) - Vec3d(p0);
  if (axis == Vec3d(0)) fail(ErrorCode::kValue, place, "p0 and p1 of a cylinder have to differ");

  // The frame from which Mitsuba counts phi.
  const Vec3d n = axis.normalized();
  const Vec3d t = (std::abs(n.x) > std::abs(n.y) ? Vec3d(n.z, 0, -n.x) : Vec3d(0, n.z, -n.y)).normalized();
  const Vec3d s = t.cross(n);
  Mesh mesh;
  for (std::uint32_t i = 0; i <= kSectors; ++i) {
    const Vec2 p = circle_point(i);
    const Vec3d outward = s * double{p.x} + t * double{p.y};
    for (const bool top : {false, true}) {
      mesh.positions.emplace_back((top ? Vec3d(p1) : Vec3d(p0)) + outward * double{radius});
      mesh.normals.emplace_back(outward);
      mesh.uvs.emplace_back(static_cast<float>(i) / kSectors, top ? 1.0f : 0.0f);
    }
  }
  for (std::uint32_t i = 0; i < 2 * kSectors; i += 2) {
    mesh.triangles.push_back({i, i + 2, i + 3});
    mesh.triangles.push_back({i, i + 3, i + 1});
  }
  return mesh;
}

}  // namespace nacre
