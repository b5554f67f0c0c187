// Exchange between Voronoi cells, and scaling.
#include "bake/area_shares.h"

#include <cstring>

#include "bake/voronoi_cells.h"
#include "nacre/cache/cache.h"

namespace nacre {
namespace {

// A sum over Voronoi cells misses a part of the integral that is proportional to the square of the local
// spacing times the integrand's Laplacian. That is even where the spacing is; where it is not, moving area
// from dense to sparse, as much as cells differ, makes up for it. Blotch at the default spacing falls from
// 0.31 % to 0.18 % of the mean (tests/bake/blotch_test.cpp); weight and width are where it is least.
constexpr float kExchange = 0.3f;
constexpr float kExchangeReach = 1.6f;  // spacings
// No share is smaller than this part of its cell, where cells differ more than those of even samples do.
constexpr float kLeastShare = 0.125f;

// A few entries at once; arrays have room for lanes beyond their end.
constexpr std::size_t kLanes = BlockNeighbourhood::kLanes;
using Lanes [[gnu::vector_size(4 * kLanes)]] = float;
using LaneNumbers [[gnu::vector_size(4 * kLanes)]] = int;
constexpr LaneNumbers kLaneNumbers{0, 1, 2, 3};
Lanes load_lanes(const float* values) {
  Lanes lanes;
  std::memcpy(&lanes, values, sizeof lanes);
  return lanes;
}

// What one gains the other loses, so that sums stay. Cells at borders are small because they are cut, and
// take no part.
std::vector<float> exchange_areas(const PointBlocks& blocks, std::span<const PlacedPoint> points,
                                  const CellAreas& cells, float spacing) {
  std::vector<float> shares(cells.areas.size());
  const float scale = 1 / square(kExchangeReach * spacing);
  blocks.for_each_block([&](const BlockNeighbourhood& near) {
    const BlockNeighbourhood::Entries& entries = near.entries();
    // Cells that take no part have no area here.
    std::vector<float> areas(entries.size() + kLanes - 1);
    for (std::size_t e = 0; e < entries.size(); ++e)
      areas[e] = cells.closed[entries.indices[e]] ? cells.areas[entries.indices[e]] : 0.0f;
    for (const std::uint32_t i : near.own()) {
      const float own = cells.areas[i];
      const Vec3 &p = points[i].position, &n = points[i].normal;
      Lanes gains{};
      if (cells.closed[i])
        near.for_each_range_near(p, [&](std::size_t begin, std::size_t end) {
          for (std::size_t e = begin; e < end; e += kLanes) {
            const auto lanes = [e](const std::vector<float>& values) { return load_lanes(&values[e]); };
            const auto& [x, y, z] = entries.positions;
            const auto& [normal_x, normal_y, normal_z] = entries.normals;
            const Lanes dx = lanes(x) - p.x, dy = lanes(y) - p.y, dz = lanes(z) - p.z;
            const Lanes q = 1 - (dx * dx + dy * dy + dz * dz) * scale, area = lanes(areas);
            const Lanes cosine = lanes(normal_x) * n.x + lanes(normal_y) * n.y + lanes(normal_z) * n.z;
            const auto counts = (q > 0) & (area > 0) & (cosine > kSameSheetCosine) &
                                (kLaneNumbers < static_cast<int>(end - e));
            gains += counts ? q * q * (own - area) : Lanes{};
          }
        });
      const float gain = gains[0] + gains[1] + gains[2] + gains[3];
      shares[i] = std::max(own + kExchange * gain, kLeastShare * own);
    }
  });
  return shares;
}

// Scales each piece's shares to its area; pieces too small to hold a point leave theirs to all the others.
void scale_shares(const GroupSurface& surface, const std::vector<PlacedPoint>& points,
                  std::vector<float>& shares) {
  std::vector<double> wanted(surface.component_count, 0.0), got(surface.component_count, 0.0);
  const auto cumulative = surface.areas.cumulative();
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    wanted[surface.components[t]] += cumulative[t] - (t ? cumulative[t - 1] : 0);
  for (std::size_t i = 0; i < points.size(); ++i) got[surface.components[points[i].triangle]] += shares[i];
  double covered = 0;
  for (std::uint32_t c = 0; c < surface.component_count; ++c)
    if (got[c] > 0) covered += wanted[c];
  const double rest = covered > 0 ? surface.areas.total() / covered : 1;
  parallel_for(points.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t c = surface.components[points[i].triangle];
      if (got[c] > 0) shares[i] = static_cast<float>(shares[i] * (wanted[c] / got[c]) * rest);
    }
  });
}

}  // namespace

std::vector<float> compute_area_shares(const GroupSurface& surface, const std::vector<PlacedPoint>& points,
                                       Progress& progress) {
  if (points.empty()) return {};
  const auto spacing =
      static_cast<float>(hexagonal_spacing(surface.areas.total(), static_cast<double>(points.size())));
  const PointBlocks blocks(points, kCellReach * spacing);
  std::vector<float> shares =
      exchange_areas(blocks, points, compute_cell_areas(surface, points, blocks, spacing, progress), spacing);
  scale_shares(surface, points, shares);
  return shares;
}

}  // namespace nacre
