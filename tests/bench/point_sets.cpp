// Random and thrown points; Fourier and Legendre sums.
#include "bench/point_sets.h"

#include <cmath>
#include <unordered_map>

#include "nacre/base/parallel.h"
#include "nacre/base/random.h"
#include "nacre/cache/cache.h"

namespace nacre::bench {
namespace {

PlacedPoint random_point(const GroupSurface& surface, Rng& rng) {
  double u = static_cast<double>(rng.next_float());
  const auto triangle = static_cast<std::uint32_t>(surface.areas.sample(u));
  const Triangle& t = surface.triangles[triangle];
  const float v = rng.next_float();
  const Vec2 b = sample_uniform_triangle({rng.next_float(), v});
  const Vec3 &p = surface.positions[t[0]], &q = surface.positions[t[1]], &r = surface.positions[t[2]];
  return {p + (q - p) * b.x + (r - p) * b.y, triangle, surface.normal(triangle)};
}

double mean_square(const std::vector<float>& weights, const std::vector<double>& window) {
  double sum = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) sum += square(double{weights[i]} * window[i]);
  return sum;
}

// Fourier transform of the Hann window (1 + cos(pi x)) / 2 on [-1, 1].
double hann_transform(double k) {
  const auto sinc = [](double x) { return std::abs(x) < 1e-9 ? 1.0 : std::sin(x) / x; };
  return sinc(k) + 0.5 * (sinc(k - kPiD) + sinc(k + kPiD));
}

}  // namespace

std::vector<PlacedPoint> random_points(const GroupSurface& surface, std::size_t count, std::uint64_t seed) {
  Rng rng(hash_words(seed, 1));
  std::vector<PlacedPoint> points;
  for (std::size_t i = 0; i < count; ++i) points.push_back(random_point(surface, rng));
  return points;
}

std::vector<PlacedPoint> thrown_points(const GroupSurface& surface, std::size_t count, std::uint64_t seed) {
  const auto distance =
      static_cast<float>(0.65 * hexagonal_spacing(surface.areas.total(), static_cast<double>(count)));
  std::unordered_map<std::uint64_t, std::vector<Vec3>> cells;
  const auto cell_of = [&](const Vec3& p, int dx, int dy, int dz) {
    const auto coordinate = [&](float x, int d) {
      return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(x / distance)) + d);
    };
    return hash_words(coordinate(p.x, dx), coordinate(p.y, dy), coordinate(p.z, dz));
  };
  Rng rng(hash_words(seed, 2));
  std::vector<PlacedPoint> points;
  while (points.size() < count) {
    const PlacedPoint dart = random_point(surface, rng);
    bool free = true;
    for (int n = 0; n < 27 && free; ++n) {
      const auto at = cells.find(cell_of(dart.position, n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1));
      if (at == cells.end()) continue;
      for (const Vec3& other : at->second) free = free && (other - dart.position).length() >= distance;
    }
    if (!free) continue;
    cells[cell_of(dart.position, 0, 0, 0)].push_back(dart.position);
    points.push_back(dart);
  }
  return points;
}

Spectrum plane_spectrum(const std::vector<PlacedPoint>& points, const std::vector<float>& weights) {
  constexpr int kDirections = 96;
  std::vector<double> window;
  double total = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3& p = points[i].position;
    window.push_back(0.25 * (1 + std::cos(kPiD * double{p.x})) * (1 + std::cos(kPiD * double{p.y})));
    total += double{weights[i]};
  }
  const double noise = mean_square(weights, window);
  const double spacing = hexagonal_spacing(4, static_cast<double>(points.size()));
  Spectrum spectrum;
  parallel_for(Spectrum::kBins, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t bin = begin; bin < end; ++bin)
      for (int d = 0; d < kDirections; ++d) {
        const Vec2 u = sobol_2d(static_cast<std::uint32_t>(d), bin);
        const double k = 2 * kPiD * (static_cast<double>(bin) + double{u.x}) * Spectrum::kWidth / spacing,
                     angle = kPiD * double{u.y}, kx = k * std::cos(angle), ky = k * std::sin(angle);
        double re = -total / 4 * hann_transform(kx) * hann_transform(ky), im = 0;
        for (std::size_t i = 0; i < points.size(); ++i) {
          const double phase = kx * double{points[i].position.x} + ky * double{points[i].position.y};
          const double weight = double{weights[i]} * window[i];
          re += weight * std::cos(phase);
          im += weight * std::sin(phase);
        }
        spectrum.power[bin] += (re * re + im * im) / noise / kDirections;
      }
  });
  return spectrum;
}

// Sum over m of |sum over i of w_i Y_lm(x_i)|^2 is (2 l + 1) / (4 pi) sum over i, j of w_i w_j P_l(x_i .
// x_j).
Spectrum sphere_spectrum(const std::vector<PlacedPoint>& points, const std::vector<float>& weights) {
  const double spacing = hexagonal_spacing(4 * kPiD, static_cast<double>(points.size()));
  const double per_degree = spacing / (2 * kPiD) / Spectrum::kWidth;  // bins
  const auto degrees = static_cast<std::size_t>(static_cast<double>(Spectrum::kBins) / per_degree);
  const double noise = mean_square(weights, std::vector<double>(weights.size(), 1.0));
  std::vector<std::vector<double>> sums(points.size());
  parallel_for(points.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      sums[i].assign(degrees + 1, 0.0);
      for (std::size_t j = 0; j < i; ++j) {
        const double x = Vec3d(points[i].position.normalized()).dot(Vec3d(points[j].position.normalized()));
        const double weight = 2 * double{weights[i]} * double{weights[j]};
        double before = 1, now = x;
        for (std::size_t l = 1; l <= degrees; ++l) {
          sums[i][l] += weight * now;
          const auto n = static_cast<double>(l);
          const double next = ((2 * n + 1) * x * now - n * before) / (n + 1);
          before = now;
          now = next;
        }
      }
    }
  });
  Spectrum spectrum;
  std::vector<int> counts(Spectrum::kBins, 0);
  for (std::size_t l = 1; l <= degrees; ++l) {
    double sum = noise;  // i = j
    for (const auto& of_point : sums) sum += of_point[l];
    const auto bin = static_cast<std::size_t>(static_cast<double>(l) * per_degree);
    if (bin >= Spectrum::kBins) break;
    spectrum.power[bin] += sum / noise;
    ++counts[bin];
  }
  for (std::size_t bin = 0; bin < Spectrum::kBins; ++bin) spectrum.power[bin] /= std::max(counts[bin], 1);
  return spectrum;
}

}  // namespace nacre::bench
