// Points spread over the surface, counted where shares are suspicious.
#include "bake/share_limits.h"

#include <algorithm>
#include <atomic>
#include <unordered_map>

#include "nacre/base/parallel.h"
#include "nacre/base/random.h"
#include "nacre/base/sampling.h"
#include "nacre/cache/cache.h"

namespace nacre {
namespace {

constexpr double kSuspicious = 2;  // times the mean share
constexpr double kCounted = 16;    // points for each mean share
constexpr double kMost = 1.5;      // times what is counted
constexpr float kReach = 2;        // spacings that a cell may reach

// The suspicious samples, found from positions that are within reach of them.
class Suspects {
 public:
  Suspects(std::span<const PlacedPoint> points, const std::vector<float>& shares, double mean, float reach)
      : reach_(reach) {
    for (std::uint32_t i = 0; i < shares.size(); ++i)
      if (double{shares[i]} > kSuspicious * mean) {
        const auto number = static_cast<std::uint32_t>(indices_.size());
        indices_.push_back(i);
        // In every cell that it may be looked for from.
        for (int n = 0; n < 27; ++n)
          cells_[cell(points[i].position, n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1)].push_back(number);
      }
  }
  const std::vector<std::uint32_t>& indices() const { return indices_; }
  /// Numbers in indices() of those that may be within reach of a position.
  std::span<const std::uint32_t> near(const Vec3& position) const {
    const auto found = cells_.find(cell(position, 0, 0, 0));
    if (found == cells_.end()) return {};
    return found->second;
  }

 private:
  std::uint64_t cell(const Vec3& p, int dx, int dy, int dz) const {
    const auto at = [&](float x, int d) {
      return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(x / reach_)) + d);
    };
    return hash_words(at(p.x, dx), at(p.y, dy), at(p.z, dz));
  }
  float reach_;
  std::vector<std::uint32_t> indices_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

// Calls visit(position, triangle) for points that are as far apart in the cumulative area of the triangles.
template <class Visit>
void visit_spread_points(const GroupSurface& surface, double area_of_each, const Visit& visit) {
  const auto cumulative = surface.areas.cumulative();
  parallel_for(cumulative.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      auto k = static_cast<std::uint64_t>(std::ceil((t ? cumulative[t - 1] : 0) / area_of_each));
      for (; static_cast<double>(k) * area_of_each < cumulative[t]; ++k) {
        const Triangle& corners = surface.triangles[t];
        const Vec3 &p = surface.positions[corners[0]], &q = surface.positions[corners[1]],
                   &r = surface.positions[corners[2]];
        const Vec2 b = sample_uniform_triangle(sobol_2d(static_cast<std::uint32_t>(k), 0));
        visit(p + (q - p) * b.x + (r - p) * b.y, t);
      }
    }
  });
}

}  // namespace

void limit_shares(const GroupSurface& surface, std::span<const PlacedPoint> points,
                  std::vector<float>& shares) {
  if (points.empty()) return;
  const double total = surface.areas.total(), mean = total / static_cast<double>(points.size());
  const float reach =
      kReach * static_cast<float>(hexagonal_spacing(total, static_cast<double>(points.size())));
  const Suspects suspects(points, shares, mean, reach);
  const std::vector<std::uint32_t>& indices = suspects.indices();
  if (indices.empty()) return;

  // What may be nearer than a suspect to something within reach of it.
  std::vector<std::vector<std::uint32_t>> rivals(indices.size());
  for (std::uint32_t i = 0; i < points.size(); ++i)
    for (const std::uint32_t s : suspects.near(points[i].position))
      if (i != indices[s]) rivals[s].push_back(i);
  std::vector<std::atomic<std::uint32_t>> counts(indices.size());
  visit_spread_points(surface, mean / kCounted, [&](const Vec3& position, std::size_t triangle) {
    for (const std::uint32_t s : suspects.near(position)) {
      const PlacedPoint& suspect = points[indices[s]];
      const Vec3 normal = surface.normal(triangle);
      const auto distance2 = [&](const PlacedPoint& point) { return (point.position - position).length2(); };
      const float own2 = distance2(suspect);
      if (dot(normal, suspect.normal) <= kSameSheetCosine || own2 > square(reach)) continue;
      if (std::ranges::none_of(rivals[s], [&](std::uint32_t i) {
            return distance2(points[i]) < own2 && dot(normal, points[i].normal) > kSameSheetCosine;
          }))
        ++counts[s];
    }
  });

  std::vector<double> before(surface.component_count, 0.0), after(surface.component_count, 0.0);
  const auto sum_up = [&](std::vector<double>& sums) {
    for (std::size_t i = 0; i < points.size(); ++i)
      sums[surface.components[points[i].triangle]] += double{shares[i]};
  };
  sum_up(before);
  for (std::size_t s = 0; s < indices.size(); ++s) {
    float& share = shares[indices[s]];
    share = std::min(share, static_cast<float>(kMost * (1.0 + counts[s]) / kCounted * mean));
  }
  sum_up(after);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint32_t c = surface.components[points[i].triangle];
    if (after[c] < before[c]) shares[i] = static_cast<float>(double{shares[i]} * before[c] / after[c]);
  }
}

}  // namespace nacre
