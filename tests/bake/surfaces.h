// Surfaces that samples are put on in tests.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <vector>

#include "bake/area_shares.h"
#include "bake/group_surface.h"
#include "bake/placement.h"
#include "bake/voronoi_cells.h"
#include "nacre/base/random.h"
#include "nacre/cache/cache.h"
#include "transport/scene_parts.h"

namespace nacre::testing_support {

/// [-1,1]^2 in the xy-plane, facing +z, cut into `strips` strips along y that get thinner towards the middle.
/// Somewhere else than at the origin the thinnest have less width than a float can hold.
inline Mesh make_sliver_plane(std::uint32_t strips) {
  Mesh mesh;
  for (std::uint32_t i = 0; i <= strips; ++i) {
    const double t = 2 * static_cast<double>(i) / strips - 1;
    const auto x = static_cast<float>(t * t * t);
    mesh.positions.emplace_back(x, -1.0f, 0.0f);
    mesh.positions.emplace_back(x, 1.0f, 0.0f);
  }
  for (std::uint32_t i = 0; i < 2 * strips; i += 2) {
    mesh.triangles.push_back({i, i + 2, i + 3});
    mesh.triangles.push_back({i, i + 3, i + 1});
  }
  return mesh;
}

/// [-1,1]^2 in the xy-plane, facing +z, in n x n squares of two triangles.
inline Mesh make_grid_plane(std::uint32_t n) {
  Mesh mesh;
  for (std::uint32_t y = 0; y <= n; ++y)
    for (std::uint32_t x = 0; x <= n; ++x)
      mesh.positions.emplace_back(-1 + 2 * static_cast<float>(x) / static_cast<float>(n),
                                  -1 + 2 * static_cast<float>(y) / static_cast<float>(n), 0.0f);
  for (std::uint32_t y = 0; y < n; ++y)
    for (std::uint32_t x = 0; x < n; ++x) {
      const std::uint32_t a = y * (n + 1) + x, b = a + n + 1;
      mesh.triangles.push_back({a, a + 1, b + 1});
      mesh.triangles.push_back({a, b + 1, b});
    }
  return mesh;
}

/// A closed sphere with bumps and, on top, noise from vertex to vertex.
inline Mesh make_bumpy_sphere() {
  Mesh mesh = make_sphere();
  for (Vec3& p : mesh.positions) {
    const auto bits = [](float x) { return static_cast<std::uint64_t>(std::lround(x * 1e6f)); };
    Rng rng(hash_words(bits(p.x), bits(p.y), bits(p.z)));
    const float bumps = 0.06f * std::sin(9 * p.x + 1) * std::sin(8 * p.y) * std::sin(7 * p.z + 2);
    p *= 1 + bumps + 0.002f * rng.next_float();
  }
  mesh.normals.clear();
  return mesh;
}

/// A thousand needles of length 1 and width 1e-9, side by side.
inline Mesh make_hair() {
  Mesh mesh;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const float x = static_cast<float>(i) * 1e-3f;
    mesh.positions.insert(mesh.positions.end(), {{x, 0, 0}, {x, 1, 0}, {x, 0, 1e-9f}});
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

inline GroupSurface make_surface(const std::vector<Mesh>& meshes) {
  std::vector<const Mesh*> pointers;
  for (const Mesh& mesh : meshes) pointers.push_back(&mesh);
  return make_group_surface(pointers);
}

inline std::vector<PlacedPoint> place(const GroupSurface& surface, double target, std::uint64_t seed = 1) {
  Progress progress;
  return place_points(surface, target, seed, progress);
}
inline std::vector<float> share(const GroupSurface& surface, const std::vector<PlacedPoint>& points) {
  Progress progress;
  return compute_area_shares(surface, points, progress);
}

/// The points' Voronoi cells, before any exchange between them.
inline std::vector<float> cell_areas(const GroupSurface& surface, const std::vector<PlacedPoint>& points) {
  Progress progress;
  const auto spacing =
      static_cast<float>(hexagonal_spacing(surface.areas.total(), static_cast<double>(points.size())));
  return compute_cell_areas(surface, points, PointBlocks(points, kCellReach * spacing), spacing, progress)
      .areas;
}

/// Smallest distance between two points whose normals agree, over the hexagonal spacing of as many points.
/// Source: Lagae & Dutre 2008, "A comparison of methods for generating Poisson disk distributions".
inline double relative_radius(const GroupSurface& surface, const std::vector<PlacedPoint>& points) {
  const double spacing = hexagonal_spacing(surface.areas.total(), static_cast<double>(points.size()));
  std::map<std::array<int, 3>, std::vector<std::size_t>> cells;
  const auto cell_of = [&](const Vec3& p) {
    return std::array{static_cast<int>(std::floor(p.x / spacing)),
                      static_cast<int>(std::floor(p.y / spacing)),
                      static_cast<int>(std::floor(p.z / spacing))};
  };
  for (std::size_t i = 0; i < points.size(); ++i) cells[cell_of(points[i].position)].push_back(i);
  double smallest2 = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto c = cell_of(points[i].position);
    for (int n = 0; n < 27; ++n) {
      const auto at = cells.find({c[0] + n % 3 - 1, c[1] + n / 3 % 3 - 1, c[2] + n / 9 - 1});
      if (at == cells.end()) continue;
      for (const std::size_t j : at->second)
        if (j > i && dot(points[i].normal, points[j].normal) > 0.2f)
          smallest2 = std::min(smallest2, (Vec3d(points[i].position) - Vec3d(points[j].position)).length2());
    }
  }
  return std::sqrt(smallest2) / spacing;
}

}  // namespace nacre::testing_support
