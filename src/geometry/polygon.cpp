// Ear clipping.
#include "geometry/polygon.h"

#include <numeric>

namespace nacre {
namespace {

// Its cubic time is bounded by this.
constexpr std::size_t kMaxClipped = 64;

struct Point2 {
  double x, y;
};

// Twice the signed area of a triangle.
double orient(const Point2& a, const Point2& b, const Point2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// The polygon seen from the side from which it is counter-clockwise, along the axis of its largest area.
// Source: Newell's normal, Sutherland et al. 1974.
std::vector<Point2> project(std::span<const Vec3> corners) {
  Vec3d normal(0);
  for (std::size_t i = 0; i < corners.size(); ++i)
    normal += (Vec3d(corners[i]) - Vec3d(corners[0]))
                  .cross(Vec3d(corners[(i + 1) % corners.size()]) - Vec3d(corners[0]));
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (std::abs(normal[k]) > std::abs(normal[axis])) axis = k;
  int x = (axis + 1) % 3, y = (axis + 2) % 3;
  if (normal[axis] < 0) std::swap(x, y);
  std::vector<Point2> points;
  points.reserve(corners.size());
  for (const Vec3& c : corners) points.push_back({c[x], c[y]});
  return points;
}

bool is_ear(const std::vector<Point2>& points, const std::vector<std::uint32_t>& left, std::size_t at) {
  const std::size_t n = left.size();
  const std::uint32_t ia = left[(at + n - 1) % n], ib = left[at], ic = left[(at + 1) % n];
  const Point2 &a = points[ia], &b = points[ib], &c = points[ic];
  if (!(orient(a, b, c) > 0)) return false;
  for (const std::uint32_t i : left) {
    if (i == ia || i == ib || i == ic) continue;
    const Point2& p = points[i];
    if (orient(a, b, p) >= 0 && orient(b, c, p) >= 0 && orient(c, a, p) >= 0) return false;
  }
  return true;
}

}  // namespace

void triangulate_polygon(std::span<const Vec3> corners, std::vector<Triangle>& triangles) {
  std::vector<std::uint32_t> left(corners.size());
  std::iota(left.begin(), left.end(), 0u);
  if (left.size() > 3 && left.size() <= kMaxClipped) {
    const std::vector<Point2> points = project(corners);
    while (left.size() > 3) {
      const std::size_t n = left.size();
      std::size_t best = n;
      double best_length = 0;
      for (std::size_t i = 0; i < n; ++i) {
        if (!is_ear(points, left, i)) continue;
        const double length =
            (Vec3d(corners[left[(i + 1) % n]]) - Vec3d(corners[left[(i + n - 1) % n]])).length();
        if (best == n || length < best_length) {
          best = i;
          best_length = length;
        }
      }
      if (best == n) break;
      triangles.push_back({left[(best + n - 1) % n], left[best], left[(best + 1) % n]});
      left.erase(left.begin() + static_cast<std::ptrdiff_t>(best));
    }
  }
  for (std::size_t i = 2; i < left.size(); ++i) triangles.push_back({left[0], left[i - 1], left[i]});
}

}  // namespace nacre
