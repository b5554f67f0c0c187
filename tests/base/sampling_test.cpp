// label: analytic
// Every sampler against its density, by chi-square; sequences by their stratification.
#include "nacre/base/sampling.h"

#include <gtest/gtest.h>

#include <functional>
#include <set>

#include "base/statistics.h"
#include "nacre/base/random.h"
#include "nacre/optics/phase.h"

namespace nacre {
namespace {

using testing_support::chi_square_p;
constexpr int kSamples = 200000;
// One test in 10,000 would fail by chance; seeds are fixed, so none does.
constexpr double kSignificance = 1e-4;

// Cells of cos(theta) x phi; expected counts by midpoint quadrature of the density per steradian.
void check_directions(const std::function<Vec3(const Vec2&)>& sample,
                      const std::function<double(const Vec3&)>& pdf) {
  constexpr int kZ = 20, kPhi = 20, kSub = 16;
  std::vector<double> counts(kZ * kPhi, 0.0), expected(kZ * kPhi, 0.0);
  Rng rng(17);
  for (int i = 0; i < kSamples; ++i) {
    const Vec3 d = sample(rng.next_2d());
    ASSERT_NEAR(d.length(), 1, 1e-5);
    const int z = std::min(kZ - 1, static_cast<int>((d.z + 1) / 2 * kZ));
    const int p = std::min(kPhi - 1, static_cast<int>((std::atan2(d.y, d.x) / (2 * kPi) + 0.5f) * kPhi));
    counts[static_cast<std::size_t>(z * kPhi + p)] += 1;
  }
  for (int z = 0; z < kZ * kSub; ++z)
    for (int p = 0; p < kPhi * kSub; ++p) {
      const double cosine = 2 * (z + 0.5) / (kZ * kSub) - 1,
                   phi = 2 * kPiD * ((p + 0.5) / (kPhi * kSub) - 0.5);
      const double sine = std::sqrt(1 - cosine * cosine);
      const Vec3 d(static_cast<float>(sine * std::cos(phi)), static_cast<float>(sine * std::sin(phi)),
                   static_cast<float>(cosine));
      expected[static_cast<std::size_t>(z / kSub * kPhi + p / kSub)] +=
          kSamples * pdf(d) * 4 * kPiD / (kZ * kSub * kPhi * kSub);
    }
  EXPECT_GT(chi_square_p(counts, expected), kSignificance);
}

TEST(Sampling, CosineHemisphere) {
  check_directions(&sample_cosine_hemisphere, [](const Vec3& d) { return pdf_cosine_hemisphere(d.z); });
}

TEST(Sampling, UniformSphere) {
  check_directions(&sample_uniform_sphere, [](const Vec3&) { return 1 / (4 * kPiD); });
}

TEST(Sampling, HenyeyGreenstein) {
  for (const float g : {-0.7f, -0.3f, 0.0f, 0.0005f, 0.6f, 0.95f})
    check_directions(
        [g](const Vec2& u) {
          const float c = sample_henyey_greenstein(g, u.x), s = std::sqrt(std::max(0.0f, 1 - c * c));
          return Vec3(s * std::cos(2 * kPi * u.y), s * std::sin(2 * kPi * u.y), c);
        },
        [g](const Vec3& d) {
          // The lobe is steep at 0.95: take the mean over the width of a quadrature cell.
          double sum = 0;
          for (int i = 0; i < 8; ++i)
            sum += eval_henyey_greenstein(d.z + static_cast<float>((i - 3.5) / 8 / 160), g);
          return sum / 8;
        });
}

TEST(Sampling, ConcentricDisk) {
  constexpr int kR = 10, kPhi = 16;
  std::vector<double> counts(kR * kPhi, 0.0),
      expected(kR * kPhi, static_cast<double>(kSamples) / (kR * kPhi));
  Rng rng(3);
  for (int i = 0; i < kSamples; ++i) {
    const Vec2 p = sample_concentric_disk(rng.next_2d());
    const int r = std::min(kR - 1, static_cast<int>(p.length2() * kR));  // rings of equal area
    const int phi = std::min(kPhi - 1, static_cast<int>((std::atan2(p.y, p.x) / (2 * kPi) + 0.5f) * kPhi));
    counts[static_cast<std::size_t>(r * kPhi + phi)] += 1;
  }
  EXPECT_GT(chi_square_p(counts, expected), kSignificance);
}

TEST(Sampling, Triangle) {
  constexpr int kCells = 12;  // of (1 - sqrt(s), t/s) where s = b + c: equal areas
  std::vector<double> counts(kCells * kCells, 0.0),
      expected(kCells * kCells, static_cast<double>(kSamples) / (kCells * kCells));
  Rng rng(5);
  for (int i = 0; i < kSamples; ++i) {
    const Vec2 b = sample_uniform_triangle(rng.next_2d());
    ASSERT_GE(b.x, 0);
    ASSERT_GE(b.y, 0);
    const float s = b.x + b.y;
    ASSERT_LE(s, 1 + 1e-6f);
    const int x = std::min(kCells - 1, static_cast<int>(s * s * kCells));
    const int y = std::min(kCells - 1, static_cast<int>(s > 0 ? b.x / s * kCells : 0));
    counts[static_cast<std::size_t>(x * kCells + y)] += 1;
  }
  EXPECT_GT(chi_square_p(counts, expected), kSignificance);
}

TEST(Sampling, Exponential) {
  constexpr int kCells = 40;
  constexpr float kRate = 2.5f, kEnd = 3;
  std::vector<double> counts(kCells, 0.0), expected(kCells, 0.0);
  Rng rng(7);
  double beyond = 0;
  for (int i = 0; i < kSamples; ++i) {
    const float t = sample_exponential(kRate, rng.next_float());
    ASSERT_TRUE(std::isfinite(t));
    if (t < kEnd)
      counts[static_cast<std::size_t>(t / kEnd * kCells)] += 1;
    else
      beyond += 1;
  }
  for (int c = 0; c < kCells; ++c)
    for (int s = 0; s < 64; ++s)
      expected[static_cast<std::size_t>(c)] +=
          kSamples *
          static_cast<double>(pdf_exponential(
              kRate, kEnd * (static_cast<float>(c) + (static_cast<float>(s) + 0.5f) / 64) / kCells)) *
          kEnd / kCells / 64;
  counts.push_back(beyond);
  expected.push_back(kSamples * std::exp(-static_cast<double>(kRate) * kEnd));
  EXPECT_GT(chi_square_p(counts, expected), kSignificance);
}

TEST(Distribution, FollowsItsWeights) {
  const std::vector<double> weights{1, 0, 3, 0.5, 0, 2};
  const Distribution distribution(weights);
  std::vector<double> counts(weights.size(), 0.0), expected, within(10, 0.0);
  Rng rng(11);
  for (int i = 0; i < kSamples; ++i) {
    double u = rng.next_double();
    counts[distribution.sample(u)] += 1;
    ASSERT_GE(u, 0);
    ASSERT_LT(u, 1);
    within[static_cast<std::size_t>(u * 10)] += 1;
  }
  for (std::size_t i = 0; i < weights.size(); ++i) expected.push_back(kSamples * distribution.pdf(i));
  EXPECT_EQ(counts[1], 0);
  EXPECT_EQ(counts[4], 0);
  EXPECT_GT(chi_square_p(counts, expected), kSignificance);
  EXPECT_GT(chi_square_p(within, std::vector<double>(10, kSamples / 10.0)), kSignificance);
  double last = std::nextafter(1.0, 0.0);
  EXPECT_EQ(distribution.sample(last), 5u);
}

TEST(Rng, IsUniformAndKeyed) {
  std::vector<double> counts(100, 0.0);
  for (std::uint64_t key = 0; key < kSamples; ++key)
    counts[static_cast<std::size_t>(Rng(hash_words(42, key)).next_float() * 100)] += 1;
  EXPECT_GT(chi_square_p(counts, std::vector<double>(100, kSamples / 100.0)), kSignificance);
  EXPECT_EQ(Rng(5).next_bits(), Rng(5).next_bits());
  EXPECT_NE(hash_words(1, 2), hash_words(2, 1));
}

// Every prefix of 2^k points puts exactly one into each elementary interval of area 2^-k.
TEST(Sobol, IsStratifiedInEveryElementaryInterval) {
  for (std::uint64_t scramble = 0; scramble < 20; ++scramble)
    for (int k = 0; k <= 8; ++k)
      for (int a = 0; a <= k; ++a) {
        const int nx = 1 << a, ny = 1 << (k - a);
        std::set<int> cells;
        for (std::uint32_t i = 0; i < (1u << k); ++i) {
          const Vec2 p = sobol_2d(i, hash_words(scramble));
          ASSERT_TRUE(p.x >= 0 && p.x < 1 && p.y >= 0 && p.y < 1);
          cells.insert(static_cast<int>(p.x * static_cast<float>(nx)) * ny +
                       static_cast<int>(p.y * static_cast<float>(ny)));
        }
        ASSERT_EQ(cells.size(), std::size_t{1} << k) << "k " << k << " a " << a;
      }
}

TEST(Sobol, OneDimensionIsStratified) {
  std::set<int> cells;
  for (std::uint32_t i = 0; i < 256; ++i) cells.insert(static_cast<int>(sobol_1d(i, 99) * 256));
  EXPECT_EQ(cells.size(), 256u);
}

// A single point of each of many scrambles is uniform: the randomization is unbiased.
TEST(Sobol, EachPointIsUniformOverScrambles) {
  for (const std::uint32_t index : {0u, 1u, 5u}) {
    std::vector<double> counts(256, 0.0);
    for (std::uint64_t s = 0; s < kSamples; ++s) {
      const Vec2 p = sobol_2d(index, hash_words(s, 8));
      counts[static_cast<std::size_t>(p.x * 16) * 16 + static_cast<std::size_t>(p.y * 16)] += 1;
    }
    EXPECT_GT(chi_square_p(counts, std::vector<double>(256, kSamples / 256.0)), kSignificance) << index;
  }
}

TEST(MakeFrame, IsOrthonormal) {
  Rng rng(1);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 n = sample_uniform_sphere(rng.next_2d());
    const Frame f = make_frame(n);
    EXPECT_NEAR(dot(f.s, f.t), 0, 1e-5);
    EXPECT_NEAR(dot(f.s, n), 0, 1e-5);
    EXPECT_NEAR((cross(f.s, f.t) - n).length(), 0, 1e-5);
  }
}

TEST(Distribution2D, SamplesCellsByWeight) {
  const std::vector<double> weights{0, 3, 1, 0, 0, 0, 2, 0, 4};
  const Distribution2D cells(weights, 3);
  EXPECT_EQ(cells.total(), 10);
  std::vector<double> counts(9), expected(9);
  Rng rng(1);
  double dx = 0, dy = 0;
  for (int i = 0; i < kSamples; ++i) {
    const Distribution2D::Cell cell = cells.sample(rng.next_2d());
    ++counts[3 * cell.y + cell.x];
    dx += cell.dx / kSamples;
    dy += cell.dy / kSamples;
  }
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_NEAR(cells.pdf(i % 3, i / 3), weights[i] / 10, 1e-15);
    expected[i] = weights[i] / 10 * kSamples;
  }
  EXPECT_GT(chi_square_p(counts, expected), kSignificance);
  EXPECT_NEAR(dx, 0.5, 5e-3);
  EXPECT_NEAR(dy, 0.5, 5e-3);
}

}  // namespace
}  // namespace nacre
