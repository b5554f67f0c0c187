// Points spread over the surface, counted where shares are suspicious.
#include "bake/share_limits.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <mutex>
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
constexpr float kPiece = 1.5f;     // times that, the longest edge of a piece of a triangle

// The suspicious samples, found from positions that are within a distance of them.
class Suspects {
 public:
  Suspects(std::span<const PlacedPoint> points, const std::vector<float>& shares, double mean, float distance)
      : distance_(distance) {
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
  /// Numbers in indices() of all that are within the distance of a position, and some more.
  std::span<const std::uint32_t> near(const Vec3& position) const {
    const auto found = cells_.find(cell(position, 0, 0, 0));
    if (found == cells_.end()) return {};
    return found->second;
  }

 private:
  std::uint64_t cell(const Vec3& p, int dx, int dy, int dz) const {
    const auto at = [&](float x, int d) {
      return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(x / distance_)) + d);
    };
    return hash_words(at(p.x, dx), at(p.y, dy), at(p.z, dz));
  }
  float distance_;
  std::vector<std::uint32_t> indices_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

// Points spread evenly over the surface, made only where suspects are near: numbered along the cumulative
// area of the triangles and of the halves into which large ones are cut.
class SpreadPoints {
 public:
  SpreadPoints(const GroupSurface& surface, const Suspects& suspects, double area_of_each, float longest_edge)
      : surface_(surface), suspects_(suspects), each_(area_of_each), longest2_(square(longest_edge)) {}

  /// Calls visit(position, triangle, numbers of the suspects that may be in reach), on all threads.
  template <class Visit>
  void visit(const Visit& visit) const {
    const auto cumulative = surface_.areas.cumulative();
    parallel_for(cumulative.size(), 256, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t) {
        const Triangle& v = surface_.triangles[t];
        visit_piece(
            {surface_.positions[v[0]], surface_.positions[v[1]], surface_.positions[v[2]]},
            t ? cumulative[t - 1] : 0, cumulative[t],
            [&](const Vec3& position, std::span<const std::uint32_t> near) { visit(position, t, near); });
      }
    });
  }

 private:
  template <class Visit>
  void visit_piece(const std::array<Vec3, 3>& p, double begin, double end, const Visit& visit) const {
    auto k = static_cast<std::uint64_t>(std::ceil(begin / each_));
    if (!(static_cast<double>(k) * each_ < end)) return;
    std::size_t longest = 0;
    const auto edge2 = [&](std::size_t e) { return (p[(e + 1) % 3] - p[e]).length2(); };
    for (const std::size_t e : {1u, 2u})
      if (edge2(e) > edge2(longest)) longest = e;
    const Vec3 &a = p[longest], &b = p[(longest + 1) % 3], &c = p[(longest + 2) % 3];
    const Vec3 middle = (a + b) * 0.5f;
    if (edge2(longest) > longest2_ && middle != a && middle != b) {
      visit_piece({a, middle, c}, begin, (begin + end) / 2, visit);
      visit_piece({middle, b, c}, (begin + end) / 2, end, visit);
      return;
    }
    const std::span<const std::uint32_t> near = suspects_.near((p[0] + p[1] + p[2]) / 3.0f);
    if (near.empty()) return;
    for (; static_cast<double>(k) * each_ < end; ++k) {
      const Vec2 w = sample_uniform_triangle(sobol_2d(static_cast<std::uint32_t>(k), 0));
      visit(p[0] + (p[1] - p[0]) * w.x + (p[2] - p[0]) * w.y, near);
    }
  }

  const GroupSurface& surface_;
  const Suspects& suspects_;
  double each_;
  float longest2_;
};

}  // namespace

void limit_shares(const GroupSurface& surface, std::span<const PlacedPoint> points,
                  std::vector<float>& shares) {
  if (points.empty()) return;
  const double total = surface.areas.total(), mean = total / static_cast<double>(points.size());
  const float reach =
      kReach * static_cast<float>(hexagonal_spacing(total, static_cast<double>(points.size())));
  // No point of a piece is farther from its centre than two thirds of its longest edge.
  const float longest_edge = kPiece * reach;
  const Suspects suspects(points, shares, mean, reach + longest_edge * 2 / 3);
  const std::vector<std::uint32_t>& indices = suspects.indices();
  if (indices.empty()) return;

  // What may be nearer than a suspect to something within reach of it.
  std::vector<std::vector<std::uint32_t>> rivals(indices.size());
  std::mutex mutex;
  parallel_for(points.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      for (const std::uint32_t s : suspects.near(points[i].position)) {
        if (i == indices[s] ||
            (points[i].position - points[indices[s]].position).length2() > square(2 * reach))
          continue;
        const std::scoped_lock lock(mutex);
        rivals[s].push_back(static_cast<std::uint32_t>(i));
      }
  });
  std::vector<std::atomic<std::uint32_t>> counts(indices.size());
  const auto count = [&](const Vec3& position, std::size_t triangle, std::span<const std::uint32_t> near) {
    const Vec3 normal = surface.normal(triangle);
    const auto distance2 = [&](const PlacedPoint& point) { return (point.position - position).length2(); };
    for (const std::uint32_t s : near) {
      const PlacedPoint& suspect = points[indices[s]];
      const float own2 = distance2(suspect);
      if (own2 > square(reach) || dot(normal, suspect.normal) <= kSameSheetCosine) continue;
      if (std::ranges::none_of(rivals[s], [&](std::uint32_t i) {
            return distance2(points[i]) < own2 && dot(normal, points[i].normal) > kSameSheetCosine;
          }))
        ++counts[s];
    }
  };
  SpreadPoints(surface, suspects, mean / kCounted, longest_edge).visit(count);

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
