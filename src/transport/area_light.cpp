// By solid angle or by area.
#include "nacre/transport/area_light.h"

#include <array>
#include <limits>

namespace nacre {
namespace {

// Meshes of more triangles are sampled by area: their solid angles would all have to be added up.
constexpr std::size_t kMostSpanned = 12;
// Below this solid angle all points look alike, and angles lose their precision.
constexpr double kLeastSolidAngle = 1e-3;

// Per steradian at x for points uniform by area; 0 from behind. Distances reach where their cubes overflow
// single precision.
float pdf_by_area(const Vec3& x, const Vec3& p, const Vec3& normal, double area) {
  const Vec3d to_light = Vec3d(p) - Vec3d(x);
  const double facing = -to_light.dot(Vec3d(normal)),  // times the distance
      distance2 = to_light.length2();
  if (!(facing > 0)) return 0;
  const double pdf = distance2 * std::sqrt(distance2) / (facing * area);
  return pdf < std::numeric_limits<float>::max() ? static_cast<float>(pdf) : 0;
}

// The unit directions of a triangle's corners.
using SphericalTriangle = std::array<Vec3d, 3>;

SphericalTriangle project(const Mesh& mesh, std::size_t triangle, const Vec3& x) {
  SphericalTriangle corners;
  for (std::size_t k = 0; k < 3; ++k)
    corners[k] = (Vec3d(mesh.positions[mesh.triangles[triangle][k]]) - Vec3d(x)).normalized();
  return corners;
}

// Of a triangle that shows its front, else 0.
double solid_angle(const SphericalTriangle& c) {
  // Counter-clockwise seen from the front is clockwise as directions from there.
  const double volume = -c[0].dot(c[1].cross(c[2]));
  const double angle = 2 * std::atan2(volume, 1 + c[0].dot(c[1]) + c[1].dot(c[2]) + c[2].dot(c[0]));
  return volume > 0 && angle > 0 ? angle : 0.0;
}

// Running sums of the triangles' solid angles.
struct Spans {
  std::array<SphericalTriangle, kMostSpanned> triangles;
  std::array<double, kMostSpanned> cumulative;
  double total = 0;
};
bool measure_spans(const Mesh& mesh, const Vec3& x, Spans& spans) {
  if (mesh.triangles.size() > kMostSpanned) return false;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    spans.triangles[t] = project(mesh, t, x);
    spans.total += solid_angle(spans.triangles[t]);
    spans.cumulative[t] = spans.total;
  }
  return spans.total > kLeastSolidAngle;
}

// Uniform by solid angle, of which the triangle has `angle`; u chooses the part of it up to an arc from b.
Vec3d sample_direction(const SphericalTriangle& corners, double angle, double u, double v) {
  const auto& [a, b, c] = corners;
  // The angle at a, between the great circles to b and c.
  const Vec3d ab = a.cross(b), ac = a.cross(c);
  const double scale = 1 / std::sqrt(ab.length2() * ac.length2());
  const double cos_a = ab.dot(ac) * scale, sin_a = ab.cross(ac).length() * scale;
  const double sin_part = std::sin(u * angle), cos_part = std::cos(u * angle);
  const double s = sin_part * cos_a - cos_part * sin_a, t = cos_part * cos_a + sin_part * sin_a;
  const double p = t - cos_a, q = s + sin_a * a.dot(b);
  const double divisor = (q * s + p * t) * sin_a;
  const double cosine = divisor != 0 ? std::clamp(((q * t - p * s) * cos_a - q) / divisor, -1.0, 1.0) : 1.0;
  const Vec3d towards_c = (c - a * a.dot(c)).normalized();
  const Vec3d edge = a * cosine + towards_c * std::sqrt(1 - cosine * cosine);
  const double z = 1 - v * (1 - edge.dot(b));
  return b * z + (edge - b * edge.dot(b)).normalized() * std::sqrt(std::max(1 - z * z, 0.0));
}

// Where a direction from x meets a triangle, kept within it.
Vec3 meet(const Mesh& mesh, std::size_t triangle, const Vec3& x, const Vec3d& direction) {
  const Triangle& t = mesh.triangles[triangle];
  const Vec3d a(mesh.positions[t[0]]), e1 = Vec3d(mesh.positions[t[1]]) - a,
                                       e2 = Vec3d(mesh.positions[t[2]]) - a, s = Vec3d(x) - a;
  const Vec3d p = direction.cross(e2), r = s.cross(e1);
  const double determinant = e1.dot(p);
  double u = std::clamp(determinant != 0 ? s.dot(p) / determinant : 1 / 3.0, 0.0, 1.0);
  double v = std::clamp(determinant != 0 ? direction.dot(r) / determinant : 1 / 3.0, 0.0, 1.0);
  if (u + v > 1) {
    const double sum = u + v;
    u /= sum;
    v /= sum;
  }
  return Vec3(a + e1 * u + e2 * v);
}

}  // namespace

AreaSample sample_area_light(const Mesh& mesh, const Distribution& areas, const Vec3& x,
                             const Vec2& u) noexcept {
  Spans spans;
  double choice = static_cast<double>(u.x);
  if (measure_spans(mesh, x, spans)) {
    std::size_t triangle = 0;
    while (spans.cumulative[triangle] <= choice * spans.total) ++triangle;
    const double before = triangle == 0 ? 0 : spans.cumulative[triangle - 1];
    const double angle = spans.cumulative[triangle] - before;
    const Vec3d direction =
        sample_direction(spans.triangles[triangle], angle,
                         std::min((choice * spans.total - before) / angle, 1.0), static_cast<double>(u.y));
    return {meet(mesh, triangle, x, direction), static_cast<float>(1 / spans.total)};
  }
  const std::size_t triangle = areas.sample(choice);
  const Vec2 b = sample_uniform_triangle({static_cast<float>(choice), u.y});
  const Triangle& t = mesh.triangles[triangle];
  const Vec3& p0 = mesh.positions[t[0]];
  const Vec3 p = p0 + (mesh.positions[t[1]] - p0) * b.x + (mesh.positions[t[2]] - p0) * b.y;
  return {p, pdf_by_area(x, p, face_normal(mesh, triangle), areas.total())};
}

float pdf_area_light(const Mesh& mesh, const Distribution& areas, const Vec3& x, const Hit& hit) noexcept {
  const float by_area =
      pdf_by_area(x, hit_position(mesh, hit), face_normal(mesh, hit.triangle), areas.total());
  Spans spans;
  if (!(by_area > 0) || !measure_spans(mesh, x, spans)) return by_area;
  return static_cast<float>(1 / spans.total);
}

}  // namespace nacre
