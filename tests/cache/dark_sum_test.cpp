// label: analytic
// Sums in the dark, where little light comes from far away: as near to the exact ones as in the light.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>

#include "cache/sample_sets.h"
#include "nacre/cache/exitance.h"
#include "nacre/optics/profile.h"

namespace nacre {
namespace {

using namespace testing_support;

Rgb half_light(const Vec3&, const Vec3& n) { return Rgb(1, 1, 1) * std::max(0.0f, n.z); }
Rgb cap_light(const Vec3&, const Vec3& n) { return n.z > 0.97f ? Rgb(1, 1, 1) : Rgb(0, 0, 0); }

// A unit sphere whose samples are 0.65 mean free paths apart.
Medium make_medium(float alpha, std::size_t samples) {
  const double spacing = hexagonal_spacing(4 * kPiD, static_cast<double>(samples));
  Medium medium;
  const auto sigma_t = static_cast<float>(0.65 / spacing);
  medium.sigma_s = Rgb(sigma_t * alpha);
  medium.sigma_a = Rgb(sigma_t * (1 - alpha));
  return medium;
}

constexpr float kAlphas[] = {0.98f, 0.9f, 0.4f};
constexpr double kTolerances[] = {0.1, 0.01};

struct Case {
  OwnedGroup owned;
  std::vector<Medium> media;
  double mean;  // irradiance
};

void for_each_case(const std::function<void(const Case&)>& check) {
  for (Rgb (*const light)(const Vec3&, const Vec3&) : {&half_light, &cap_light})
    for (const int n : {64, 160}) {
      const SurfaceSamples samples = make_sphere(n, light);
      Case one{make_group(samples), {}, 0};
      for (std::size_t i = 0; i < samples.size(); ++i)
        one.mean +=
            static_cast<double>(samples.areas[i]) * static_cast<double>(samples.irradiance[i].x) / (4 * kPiD);
      for (const float alpha : kAlphas) one.media.push_back(make_medium(alpha, samples.size()));
      check(one);
    }
}

std::vector<Vec3> make_points() {
  std::vector<Vec3> points;
  Rng rng(3);
  for (int i = 0; i < 1500; ++i) {
    const float z = 2 * rng.next_float() - 1, phi = 2 * kPi * rng.next_float(), s = std::sqrt(1 - z * z);
    points.emplace_back(s * std::cos(phi), s * std::sin(phi), z);
  }
  return points;
}

// By bands of three powers of e below what the mean irradiance makes; of values `stride` apart.
void expect_within(const Case& one, const Medium& medium, std::span<const Rgb> exact,
                   std::span<const Rgb> values, std::size_t stride, double tolerance) {
  struct Band {
    double error = 0, norm = 0;
    int count = 0;
  };
  std::map<int, Band> bands;
  const double mean = one.mean * make_profiles(medium)[0].total;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const double value = static_cast<double>(exact[i].x);
    if (!(value > 1e-34)) continue;  // single precision ends
    Band& band = bands[std::max(0, static_cast<int>(std::log(mean / value) / 3 + 1))];
    band.error += square(static_cast<double>(values[i * stride].x) - value);
    band.norm += square(value);
    ++band.count;
  }
  ASSERT_GE(bands.size(), 2u);
  for (const auto& [index, band] : bands) {
    if (band.count <= 20) continue;
    EXPECT_LE(std::sqrt(band.error / band.norm), tolerance)
        << "samples " << one.owned.group.size() << ", sigma_a " << medium.sigma_a.x << ", tolerance "
        << tolerance << ", band " << index;
  }
}

TEST(DarkSum, EveryBandIsWithinTheTolerance) {
  const std::vector<Vec3> points = make_points();
  for_each_case([&](const Case& one) {
    for (const Medium& medium : one.media) {
      std::vector<Rgb> exact(points.size()), values(points.size());
      std::uint64_t evaluations = 0;
      Exitance(one.owned.group, medium, 0).eval_exact(points, exact, evaluations);
      for (const double tolerance : kTolerances) {
        Exitance(one.owned.group, medium, tolerance).eval(points, values, evaluations);
        expect_within(one, medium, exact, values, 1, tolerance);
      }
    }
  });
}

TEST(DarkSum, EveryMemberOfAFamilyIs) {
  const std::vector<Vec3> points = make_points();
  for_each_case([&](const Case& one) {
    const std::size_t count = one.media.size();
    const MaterialFamily family{one.media, {0, 1, 2}};
    std::vector<Rgb> exact(points.size()), values(points.size() * count);
    std::uint64_t evaluations = 0;
    for (const double tolerance : kTolerances) {
      Exitance(one.owned.group, family, tolerance).eval(points, values, evaluations);
      for (std::size_t m = 0; m < count; ++m) {
        Exitance(one.owned.group, one.media[m], 0).eval_exact(points, exact, evaluations);
        expect_within(one, one.media[m], exact, std::span(values).subspan(m), count, tolerance);
      }
    }
  });
}

}  // namespace
}  // namespace nacre
