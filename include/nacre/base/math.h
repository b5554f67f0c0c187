// Vectors, colours, matrices (Imath), and the few functions on them that every layer uses.
#pragma once

#include <ImathBox.h>
#include <ImathColor.h>
#include <ImathMatrix.h>
#include <ImathVec.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nacre {

using Vec2 = Imath::V2f;
using Vec3 = Imath::V3f;
using Vec3d = Imath::V3d;
using Box3 = Imath::Box3f;
/// Row vectors, as Imath has them: p * m applies m, and a * b applies a first.
using Matrix4 = Imath::M44d;
/// Three independent channels, scene-linear.
using Rgb = Imath::C3f;

inline constexpr float kPi = std::numbers::pi_v<float>;
inline constexpr double kPiD = std::numbers::pi;

inline float dot(const Vec3& a, const Vec3& b) { return a.dot(b); }
inline Vec3 cross(const Vec3& a, const Vec3& b) { return a.cross(b); }
inline float max_channel(const Rgb& c) { return std::max(c.x, std::max(c.y, c.z)); }
inline float min_channel(const Rgb& c) { return std::min(c.x, std::min(c.y, c.z)); }
inline float mean_channel(const Rgb& c) { return (c.x + c.y + c.z) / 3.0f; }
inline bool is_black(const Rgb& c) { return c.x == 0 && c.y == 0 && c.z == 0; }
inline bool is_finite(const Vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}
template <class T>
constexpr T square(T x) {
  return x * x;
}

/// Right-handed orthonormal frame whose third axis is `n` (unit length).
/// Source: Duff et al. 2017, "Building an orthonormal basis, revisited".
struct Frame {
  Vec3 s, t, n;
  Vec3 to_world(const Vec3& v) const { return s * v.x + t * v.y + n * v.z; }
  Vec3 to_local(const Vec3& v) const { return {s.dot(v), t.dot(v), n.dot(v)}; }
};
inline Frame make_frame(const Vec3& n) {
  const float sign = std::copysign(1.0f, n.z);
  const float a = -1.0f / (sign + n.z);
  const float b = n.x * n.y * a;
  return {{1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
}

}  // namespace nacre
