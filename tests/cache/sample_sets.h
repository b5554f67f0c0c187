// Sample sets whose surface and irradiance are known, for tests of the cache.
#pragma once

#include <functional>

#include "nacre/base/random.h"
#include "nacre/cache/cache.h"
#include "nacre/cache/octree.h"
#include "nacre/optics/medium.h"

namespace nacre::testing_support {

using Light = std::function<Rgb(const Vec3& position, const Vec3& normal)>;

inline Rgb uniform_light(const Vec3&, const Vec3&) { return {1, 1, 1}; }
/// From +x and +z only: half of a sphere and one sheet of two are dark.
inline Rgb side_light(const Vec3&, const Vec3& n) {
  return Rgb(1, 1, 1) * std::max(0.0f, 0.6f * n.x + 0.8f * n.z);
}
/// A red, a green and a blue patch with soft edges: channels differ by orders of magnitude between places.
inline Rgb coloured_light(const Vec3& p, const Vec3&) {
  return {std::exp(-4 * (p - Vec3(0.5f, 0, 0)).length2()),
          3 * std::exp(-4 * (p - Vec3(-0.5f, 0, 0)).length2()),
          2 * std::exp(-2 * (p - Vec3(0, 0.7f, 0)).length2())};
}
/// On a spot near the edge of planes, and so noisy that every other sample there is dark.
inline Rgb spot_light(const Vec3& p, const Vec3&) {
  const bool lit = (p - Vec3(0.9f, 0.1f, 0.2f)).length2() < square(0.3f) &&
                   hash_words(19, std::bit_cast<std::uint32_t>(p.x)) % 2 == 0;
  return lit ? Rgb(1, 0.5f, 0.8f) : Rgb(0, 0, 0);
}

inline void add_sample(SurfaceSamples& samples, const Vec3& position, const Vec3& normal, double area,
                       const Light& light) {
  samples.positions.push_back(position);
  samples.normals.push_back(normal);
  samples.areas.push_back(static_cast<float>(area));
  samples.irradiance.push_back(light(position, normal));
}

/// n x n samples, one in each cell of a square of that half-width at height z; exact shares.
inline void add_sheet(SurfaceSamples& samples, int n, float half, float z, float normal_z, const Light& light,
                      float jitter = 0.8f) {
  Rng rng(hash_words(17, static_cast<std::uint64_t>(n)));
  const float cell = 2 * half / static_cast<float>(n);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const float u = 0.5f + jitter * (rng.next_float() - 0.5f),
                  v = 0.5f + jitter * (rng.next_float() - 0.5f);
      add_sample(samples,
                 {-half + (static_cast<float>(i) + u) * cell, -half + (static_cast<float>(j) + v) * cell, z},
                 {0, 0, normal_z}, static_cast<double>(cell) * static_cast<double>(cell), light);
    }
}

inline SurfaceSamples make_plane(int n, const Light& light) {
  SurfaceSamples samples;
  add_sheet(samples, n, 1, 0, 1, light);
  return samples;
}

/// Two parallel sheets, 0.05 apart: light from one leaves through the other.
inline SurfaceSamples make_two_sheets(int n, const Light& light) {
  SurfaceSamples samples;
  add_sheet(samples, n, 1, 0.025f, 1, light);
  add_sheet(samples, n, 1, -0.025f, -1, light);
  return samples;
}

/// Unit sphere: cells of equal area in (z, azimuth), one jittered sample each.
inline SurfaceSamples make_sphere(int n, const Light& light) {
  SurfaceSamples samples;
  Rng rng(23);
  const int around = 2 * n;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < around; ++i) {
      const float z = 1 - 2 * (static_cast<float>(j) + rng.next_float()) / static_cast<float>(n);
      const float phi = 2 * kPi * (static_cast<float>(i) + rng.next_float()) / static_cast<float>(around);
      const float s = std::sqrt(std::max(0.0f, 1 - z * z));
      const Vec3 p(s * std::cos(phi), s * std::sin(phi), z);
      add_sample(samples, p, p, 4 * kPiD / (n * around), light);
    }
  return samples;
}

/// A group that owns its data.
struct OwnedGroup {
  std::vector<std::shared_ptr<const void>> storage;
  CacheGroup group;
};
inline OwnedGroup make_group(const SurfaceSamples& samples, const std::string& name = "wax") {
  OwnedGroup owned;
  double area = 0;
  for (const float a : samples.areas) area += static_cast<double>(a);
  owned.group = build_group(name, area, samples, owned.storage);
  return owned;
}

inline Medium make_material(std::string_view preset, ProfileKind profile, float mm_per_unit) {
  Medium medium = make_medium(*find_preset(preset));
  medium.profile = profile;
  medium.scale = mm_per_unit;
  return medium;
}

}  // namespace nacre::testing_support
