// The GGX distribution of microfacet normals, in the local frame of a surface.
#pragma once

#include "nacre/base/math.h"
#include "nacre/base/sampling.h"

namespace nacre {

/// Roughness `x` and `y` along the axes of the frame. Normals are unit vectors with z > 0; directions v may
/// point to either side. Source: Heitz 2014; Heitz 2018 for sampling.
struct Ggx {
  float x, y;

  /// Density of normals per unit of surface and steradian.
  float density(const Vec3& m) const noexcept {
    const float slope = square(m.x / x) + square(m.y / y) + m.z * m.z;
    return 1 / (kPi * x * y * slope * slope);
  }
  /// Smith's Lambda: what masks a direction, over what of it is seen.
  float lambda(const Vec3& v) const noexcept {
    const float tan2 = (square(x * v.x) + square(y * v.y)) / std::max(v.z * v.z, 1e-30f);
    return (std::sqrt(1 + tan2) - 1) / 2;
  }
  float masking(const Vec3& v) const noexcept { return 1 / (1 + lambda(v)); }
  /// Height-correlated, for reflection and transmission alike.
  float shadowing_masking(const Vec3& a, const Vec3& b) const noexcept {
    return 1 / (1 + lambda(a) + lambda(b));
  }
  /// Density per steradian of sample_visible_normal for v.z > 0.
  float visible_pdf(const Vec3& v, const Vec3& m) const noexcept {
    return masking(v) * std::max(0.0f, dot(v, m)) * density(m) / v.z;
  }
  Vec3 sample_visible_normal(const Vec3& v, const Vec2& u) const noexcept {
    const Vec3 stretched = Vec3(x * v.x, y * v.y, v.z).normalized();
    const float length2 = square(stretched.x) + square(stretched.y);
    const Vec3 s = length2 > 0 ? Vec3(-stretched.y, stretched.x, 0) / std::sqrt(length2) : Vec3(1, 0, 0);
    const Vec3 t = cross(stretched, s);
    const float radius = std::sqrt(u.x), phi = 2 * kPi * u.y;
    const float a = radius * std::cos(phi), lift = (1 + stretched.z) / 2;
    const float b = (1 - lift) * std::sqrt(std::max(0.0f, 1 - a * a)) + lift * radius * std::sin(phi);
    const Vec3 n = s * a + t * b + stretched * std::sqrt(std::max(0.0f, 1 - a * a - b * b));
    return Vec3(x * n.x, y * n.y, std::max(1e-6f, n.z)).normalized();
  }
};

}  // namespace nacre
