// The irradiance cache in memory: samples and octree of each group, and what they depend on.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "nacre/base/math.h"
#include "nacre/optics/eta_change.h"

namespace nacre {

/// What some of the lights send into samples. Any of the vectors may be empty: not known.
struct SampleLight {
  std::string name;               // of the lights; empty: all of them
  std::vector<Rgb> irradiance;    // transmitted irradiance E_t; empty for the only ones
  std::vector<float> errors;      // standard error of the mean of its channels
  std::vector<EtaRatios> ratios;  // for other indices of refraction
};

/// Samples of one group as bake makes them. Positions and normals in scene units and world space; `areas` are
/// shares of the surface, scene units^2; `irradiance` is the transmitted irradiance E_t, the sum over
/// `lights` where these are known.
struct SurfaceSamples {
  std::vector<Vec3> positions, normals;
  std::vector<float> areas;
  std::vector<Rgb> irradiance;
  std::vector<SampleLight> lights;
  std::size_t size() const { return positions.size(); }
};

/// The planes in which a cache holds its samples, in octree order.
enum class Plane {
  kX,
  kY,
  kZ,
  kNormalX,
  kNormalY,
  kNormalZ,
  kArea,
  kIrradianceR,
  kIrradianceG,
  kIrradianceB
};
inline constexpr std::size_t kPlaneCount = 10;

/// One node of an octree: 64 bytes, as it stands in the file. Nodes are in breadth-first order, the children
/// of a node side by side and those of successive nodes in succession; a node's samples are one range, which
/// its children divide in order.
struct OctreeNode {
  float
      centre[3];  // centroid of the samples, weighted by E_t A summed over channels (by A where that is zero)
  float radius;   // largest distance of a sample from the centre
  float power[3];             // sum of E_t A
  float second_moment[3];     // sum of E_t A |x - centre|^2
  float first_moment[3];      // length of sum of E_t A (x - centre)
  std::uint32_t first_child;  // index of the first child; 0 for a leaf
  std::uint32_t first_sample;
  std::uint32_t packed_counts;  // bits 0-27: samples, bits 28-31: children

  std::uint32_t sample_count() const { return packed_counts & 0x0fffffffu; }
  std::uint32_t child_count() const { return packed_counts >> 28; }
};
static_assert(sizeof(OctreeNode) == 64);

inline constexpr std::uint32_t kMaxSamplesPerGroup = 0x0fffffffu;
inline constexpr std::uint32_t kMaxLeafSamples = 8;
inline constexpr int kMaxOctreeDepth = 21;  // bits of a Morton code per axis

/// The part of a group's irradiance that lights of one name send: one float per sample, in octree order.
/// Spans are empty where nothing is known; those of successive lights follow each other in memory.
struct LightPlane {
  std::string name;  // empty: all of the lights
  std::array<std::span<const float>, 3> irradiance;
  std::span<const float> errors;
  std::span<const EtaRatios> ratios;
};

/// All shapes that share one subsurface element: they scatter light into each other and into nothing else.
struct CacheGroup {
  std::string name;
  double surface_area = 0;  // scene units^2
  double eta = 0;           // relative index for which the irradiance is; 0: not known
  std::array<std::span<const float>, kPlaneCount> planes;
  std::span<const OctreeNode> nodes;
  std::vector<LightPlane> lights;  // whose sum the irradiance is

  std::size_t size() const { return planes[0].size(); }
  std::span<const float> plane(Plane p) const { return planes[static_cast<std::size_t>(p)]; }
  Vec3 position(std::size_t i) const { return {planes[0][i], planes[1][i], planes[2][i]}; }
  Vec3 normal(std::size_t i) const { return {planes[3][i], planes[4][i], planes[5][i]}; }
  float area(std::size_t i) const { return planes[6][i]; }
  Rgb irradiance(std::size_t i) const { return {planes[7][i], planes[8][i], planes[9][i]}; }
};

/// Named values in a fixed order.
using KeyValues = std::vector<std::pair<std::string, std::string>>;

/// A baked cache, in memory or mapped from a file; copies share the storage.
struct Cache {
  KeyValues fingerprint;  // what the numbers depend on, e.g. "light key/position" -> "0 1 2"
  KeyValues info;         // what is recorded but never compared: version, seed, spacing, coefficients
  std::vector<CacheGroup> groups;  // parallel to the scene's media
  std::shared_ptr<const void> storage;

  std::size_t sample_count() const {
    std::size_t count = 0;
    for (const CacheGroup& group : groups) count += group.size();
    return count;
  }
};

/// Distance of a hexagonal lattice of the same density: sqrt(2/sqrt(3) * area / count).
double hexagonal_spacing(double area, double count);
inline double hexagonal_spacing(const CacheGroup& group) {
  return hexagonal_spacing(group.surface_area, static_cast<double>(group.size()));
}

}  // namespace nacre
