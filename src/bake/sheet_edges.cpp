// Entering each edge into every cell that it comes near.
#include "bake/sheet_edges.h"

#include <algorithm>
#include <cmath>

namespace nacre {

SheetEdgeGrid::SheetEdgeGrid(std::span<const SheetEdge> edges, std::span<const PlacedPoint> points,
                             float reach)
    : edges_(edges), reach_(reach) {
  if (edges.empty()) return;
  for (const PlacedPoint& point : points) {
    const Coordinates c = cell_of(point.position);
    cells_.try_emplace(cell_key(c), Cell{c, {}});
  }
  for (std::uint32_t e = 0; e < edges.size(); ++e) enter(e);
}

void SheetEdgeGrid::enter(std::uint32_t e) {
  const Vec3& a = edges_[e].a;
  const Vec3 along = edges_[e].b - a;
  const auto add = [&](Cell& cell) {
    if (cell.edges.empty() || cell.edges.back() != e) cell.edges.push_back(e);
  };
  // Points half a cell apart along the edge; the 27 cells around each hold all that is within reach of them.
  const float steps = std::ceil(along.length() / (0.5f * reach_)) + 1;
  if (27 * steps < static_cast<float>(cells_.size())) {
    for (float s = 0; s <= steps; ++s) {
      const Coordinates c = cell_of(a + along * (s / steps));
      for (std::int64_t z = c[2] - 1; z <= c[2] + 1; ++z)
        for (std::int64_t y = c[1] - 1; y <= c[1] + 1; ++y)
          for (std::int64_t x = c[0] - 1; x <= c[0] + 1; ++x)
            if (const auto at = cells_.find(cell_key({x, y, z})); at != cells_.end()) add(at->second);
    }
    return;
  }
  // An edge that passes more cells than there are: those whose middle is near enough.
  const float length2 = along.length2();
  for (auto& [key, cell] : cells_) {
    const Vec3 middle = Vec3(static_cast<float>(cell.at[0]) + 0.5f, static_cast<float>(cell.at[1]) + 0.5f,
                             static_cast<float>(cell.at[2]) + 0.5f) *
                        reach_;
    const float t = length2 > 0 ? std::clamp(dot(middle - a, along) / length2, 0.0f, 1.0f) : 0.0f;
    if ((a + along * t - middle).length2() <= square(2 * reach_)) add(cell);
  }
}

SheetEdgeGrid::Coordinates SheetEdgeGrid::cell_of(const Vec3& point) const {
  Coordinates c;
  for (int axis = 0; axis < 3; ++axis)
    c[static_cast<std::size_t>(axis)] = static_cast<std::int64_t>(std::floor(point[axis] / reach_));
  return c;
}

std::uint64_t SheetEdgeGrid::cell_key(const Coordinates& c) {
  constexpr std::uint64_t kMask = (1u << 21) - 1;
  return (static_cast<std::uint64_t>(c[0]) & kMask) << 42 | (static_cast<std::uint64_t>(c[1]) & kMask) << 21 |
         (static_cast<std::uint64_t>(c[2]) & kMask);
}

}  // namespace nacre
