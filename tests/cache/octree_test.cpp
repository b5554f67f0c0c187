// label: unit
// The octree against brute force: order, ranges, moments.
#include "nacre/cache/octree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "cache/sample_sets.h"
#include "nacre/base/error.h"

namespace nacre {
namespace {

using namespace testing_support;

SurfaceSamples make_cloud(std::size_t count, std::uint64_t seed) {
  SurfaceSamples samples;
  Rng rng(seed);
  for (std::size_t i = 0; i < count; ++i) {
    // Clustered: depths differ.
    const float scale = rng.next_float() < 0.5f ? 1.0f : 0.01f;
    const Vec3 p = Vec3(rng.next_float(), rng.next_float(), rng.next_float()) * scale + Vec3(5, -3, 0);
    samples.positions.push_back(p);
    samples.normals.push_back({0, static_cast<float>(i), 1});  // tells which sample it is
    samples.areas.push_back(rng.next_float() + 0.1f);
    samples.irradiance.push_back({rng.next_float(), rng.next_float() < 0.3f ? 0.0f : rng.next_float(), 0});
  }
  return samples;
}

void expect_every_sample_once(const CacheGroup& group, const SurfaceSamples& samples) {
  ASSERT_EQ(group.size(), samples.size());
  std::vector<bool> seen(samples.size(), false);
  for (std::size_t i = 0; i < group.size(); ++i) {
    const auto from = static_cast<std::size_t>(group.normal(i).y);
    ASSERT_LT(from, samples.size());
    ASSERT_FALSE(seen[from]);
    seen[from] = true;
    EXPECT_EQ(group.position(i), samples.positions[from]);
    EXPECT_EQ(group.normal(i), samples.normals[from]);
    EXPECT_EQ(group.area(i), samples.areas[from]);
    EXPECT_EQ(group.irradiance(i), samples.irradiance[from]);
  }
}

void expect_tree(const CacheGroup& group) {
  ASSERT_FALSE(group.nodes.empty());
  ASSERT_EQ(group.nodes[0].first_sample, 0u);
  ASSERT_EQ(group.nodes[0].sample_count(), group.size());
  std::uint32_t next = 1;
  for (const OctreeNode& node : group.nodes) {
    if (node.child_count() == 0) {
      EXPECT_EQ(node.first_child, 0u);
      continue;
    }
    EXPECT_LE(node.child_count(), 8u);
    EXPECT_GT(node.sample_count(), kMaxLeafSamples);
    EXPECT_EQ(node.first_child, next);
    std::uint32_t sample = node.first_sample;
    for (std::uint32_t c = 0; c < node.child_count(); ++c) {
      ASSERT_LT(next, group.nodes.size());
      EXPECT_EQ(group.nodes[next].first_sample, sample);
      EXPECT_GT(group.nodes[next].sample_count(), 0u);
      sample += group.nodes[next++].sample_count();
    }
    EXPECT_EQ(sample, node.first_sample + node.sample_count());
  }
  EXPECT_EQ(next, group.nodes.size());
}

void expect_moments(const CacheGroup& group) {
  for (const OctreeNode& node : group.nodes) {
    const Vec3d centre(static_cast<double>(node.centre[0]), static_cast<double>(node.centre[1]),
                       static_cast<double>(node.centre[2]));
    double power[3]{}, second[3]{}, radius = 0, weight = 0, area = 0;
    Vec3d first[3]{Vec3d(0.0), Vec3d(0.0), Vec3d(0.0)}, weighted(0.0), plain(0.0);
    for (std::size_t i = node.first_sample; i < node.first_sample + node.sample_count(); ++i) {
      const Vec3d x(group.position(i)), d = x - centre;
      radius = std::max(radius, d.length());
      const auto a = static_cast<double>(group.area(i));
      for (int k = 0; k < 3; ++k) {
        const double w = static_cast<double>(group.irradiance(i)[k]) * a;
        power[k] += w;
        second[k] += w * d.length2();
        first[k] += d * w;
        weight += w;
        weighted += x * w;
      }
      plain += x * a;
      area += a;
    }
    const Vec3d centroid = weight > 0 ? weighted / weight : plain / area;
    EXPECT_LT((centroid - centre).length(), 1e-6);
    EXPECT_GE(static_cast<double>(node.radius), radius);
    EXPECT_LE(static_cast<double>(node.radius), radius * (1 + 1e-6));
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(static_cast<double>(node.power[k]), power[k], 1e-6 * power[k]);
      EXPECT_GE(static_cast<double>(node.second_moment[k]) * (1 + 1e-12), second[k]);
      EXPECT_LE(static_cast<double>(node.second_moment[k]), second[k] * (1 + 1e-6));
      EXPECT_GE(static_cast<double>(node.first_moment[k]) * (1 + 1e-9), first[k].length() * (1 - 1e-9));
      EXPECT_LE(static_cast<double>(node.first_moment[k]), first[k].length() * (1 + 1e-6) + 1e-12);
    }
  }
}

TEST(Octree, HoldsEverySampleOnceInNestedRanges) {
  for (const std::size_t count : {2u, 8u, 9u, 100u, 20000u}) {
    const SurfaceSamples samples = make_cloud(count, count);
    const OwnedGroup owned = make_group(samples);
    expect_every_sample_once(owned.group, samples);
    expect_tree(owned.group);
    for (const OctreeNode& node : owned.group.nodes)
      if (node.child_count() == 0) {
        EXPECT_LE(node.sample_count(), kMaxLeafSamples);
      }
  }
}

TEST(Octree, MomentsAreThoseOfTheSamples) {
  expect_moments(make_group(make_cloud(3000, 4)).group);
  expect_moments(make_group(make_sphere(20, side_light)).group);
}

TEST(Octree, ChildrenAreOctantsOfOneCube) {
  const OwnedGroup owned = make_group(make_cloud(5000, 5));
  const CacheGroup& group = owned.group;
  // Boxes of siblings do not overlap.
  const auto box_of = [&](const OctreeNode& node) {
    Box3 box;
    for (std::size_t i = node.first_sample; i < node.first_sample + node.sample_count(); ++i)
      box.extendBy(group.position(i));
    return box;
  };
  for (const OctreeNode& node : group.nodes)
    for (std::uint32_t a = 0; a < node.child_count(); ++a)
      for (std::uint32_t b = a + 1; b < node.child_count(); ++b) {
        const Box3 x = box_of(group.nodes[node.first_child + a]),
                   y = box_of(group.nodes[node.first_child + b]);
        const bool apart = x.max.x < y.min.x || y.max.x < x.min.x || x.max.y < y.min.y || y.max.y < x.min.y ||
                           x.max.z < y.min.z || y.max.z < x.min.z;
        EXPECT_TRUE(apart);
      }
}

TEST(Octree, DarkNodesAreCentredByArea) {
  SurfaceSamples samples = make_cloud(500, 6);
  for (Rgb& e : samples.irradiance) e = {0, 0, 0};
  const OwnedGroup owned = make_group(samples);
  expect_moments(owned.group);
  for (const OctreeNode& node : owned.group.nodes)
    EXPECT_EQ(node.power[0] + node.power[1] + node.power[2], 0);
}

TEST(Octree, SamplesWithoutAreaGiveFiniteNodes) {
  SurfaceSamples samples = make_cloud(100, 7);
  for (float& a : samples.areas) a = 0;
  for (const OctreeNode& node : make_group(samples).group.nodes) {
    EXPECT_TRUE(std::isfinite(node.centre[0]) && std::isfinite(node.radius));
    EXPECT_EQ(node.power[0], 0);
  }
}

TEST(Octree, IdenticalPositionsEndInOneLeaf) {
  SurfaceSamples samples = make_cloud(1000, 8);
  for (Vec3& p : samples.positions) p = {1, 2, 3};
  const OwnedGroup same = make_group(samples);
  expect_every_sample_once(same.group, samples);
  expect_tree(same.group);
  expect_moments(same.group);
  samples.positions[0] = {2, 2, 3};
  const OwnedGroup but_one = make_group(samples);
  expect_every_sample_once(but_one.group, samples);
  expect_tree(but_one.group);
  // A chain of single children down to the finest level, and no further.
  EXPECT_LE(but_one.group.nodes.size(), static_cast<std::size_t>(kMaxOctreeDepth) + 2);
}

TEST(Octree, OneSampleIsALeaf) {
  const OwnedGroup owned = make_group(make_cloud(1, 9));
  ASSERT_EQ(owned.group.nodes.size(), 1u);
  expect_tree(owned.group);
  expect_moments(owned.group);
  EXPECT_EQ(owned.group.nodes[0].radius, 0);
}

TEST(Octree, NoSampleIsNoNode) {
  const OwnedGroup owned = make_group({});
  EXPECT_EQ(owned.group.size(), 0u);
  EXPECT_TRUE(owned.group.nodes.empty());
}

TEST(Octree, IsTheSameEveryTime) {
  const SurfaceSamples samples = make_cloud(30000, 10);
  const OwnedGroup a = make_group(samples), b = make_group(samples);
  ASSERT_EQ(a.group.nodes.size(), b.group.nodes.size());
  EXPECT_EQ(std::memcmp(a.group.nodes.data(), b.group.nodes.data(), a.group.nodes.size_bytes()), 0);
  for (std::size_t k = 0; k < kPlaneCount; ++k)
    EXPECT_TRUE(std::equal(a.group.planes[k].begin(), a.group.planes[k].end(), b.group.planes[k].begin()));
}

TEST(HexagonalSpacing, IsThatOfALattice) {
  // A unit lattice has one point per sqrt(3)/2.
  EXPECT_NEAR(hexagonal_spacing(std::sqrt(3.0) / 2 * 1000, 1000), 1, 1e-12);
  EXPECT_EQ(hexagonal_spacing(1, 0), 0);
}

}  // namespace
}  // namespace nacre
