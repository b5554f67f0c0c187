// What the tests of single scattering share.
#pragma once

#include <gtest/gtest.h>

#include "../transport/scene_parts.h"
#include "nacre/base/random.h"
#include "nacre/render/single_scattering.h"

namespace nacre::testing_support {

inline Medium make_test_medium() {
  Medium medium;
  medium.sigma_s = {0.5f, 1.0f, 3.0f};
  medium.sigma_a = {0.05f, 0.5f, 0.2f};
  medium.int_ior = 1.4f;
  medium.ext_ior = 1.0f;
  return medium;
}

inline SurfacePoint point_at(const World& world, const Vec3& origin, const Vec3& direction) {
  return surface_point(world, world.tracer.intersect({origin, direction}));
}

// Mean of `groups` estimates of `per_group` samples each, and the standard error of that mean.
struct Estimate {
  Rgb mean{0, 0, 0}, error{0, 0, 0};
};
inline Estimate estimate_many(const SingleScattering& single, const SurfacePoint& point, const Vec3& out,
                              int groups, int per_group) {
  Vec3d sum(0, 0, 0), squares(0, 0, 0);
  LostSamples lost;
  for (int i = 0; i < groups; ++i) {
    const Vec3d value(
        single.estimate(point, out, per_group, hash_words(7, static_cast<std::uint64_t>(i)), 0, lost));
    sum += value;
    squares += value * value;
  }
  EXPECT_EQ(lost.lost, 0u);
  Estimate result;
  for (int k = 0; k < 3; ++k) {
    const double mean = sum[k] / groups;
    result.mean[k] = static_cast<float>(mean);
    result.error[k] =
        static_cast<float>(std::sqrt(std::max(squares[k] / groups - mean * mean, 0.0) / groups));
  }
  return result;
}

}  // namespace nacre::testing_support
