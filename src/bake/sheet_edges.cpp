// Entering each edge into every cell that it comes near.
#include "bake/sheet_edges.h"

#include <cmath>

namespace nacre {
namespace {

std::uint64_t key_of(std::int64_t x, std::int64_t y, std::int64_t z) {
  constexpr std::uint64_t kMask = (1u << 21) - 1;
  return (static_cast<std::uint64_t>(x) & kMask) << 42 | (static_cast<std::uint64_t>(y) & kMask) << 21 |
         (static_cast<std::uint64_t>(z) & kMask);
}

}  // namespace

SheetEdgeGrid::SheetEdgeGrid(std::span<const SheetEdge> edges, float reach) : edges_(edges), reach_(reach) {
  for (std::uint32_t e = 0; e < edges.size(); ++e) {
    // Points half a cell apart along the edge; the 27 cells around each hold all that is within reach of
    // them.
    const Vec3 along = edges[e].b - edges[e].a;
    const auto steps = static_cast<std::size_t>(std::ceil(along.length() / (0.5f * reach))) + 1;
    for (std::size_t s = 0; s <= steps; ++s) {
      const Vec3 p = edges[e].a + along * (static_cast<float>(s) / static_cast<float>(steps));
      std::int64_t c[3];
      for (int axis = 0; axis < 3; ++axis) c[axis] = static_cast<std::int64_t>(std::floor(p[axis] / reach));
      for (std::int64_t z = c[2] - 1; z <= c[2] + 1; ++z)
        for (std::int64_t y = c[1] - 1; y <= c[1] + 1; ++y)
          for (std::int64_t x = c[0] - 1; x <= c[0] + 1; ++x) {
            auto& cell = cells_[key_of(x, y, z)];
            if (cell.empty() || cell.back() != e) cell.push_back(e);
          }
    }
  }
}

std::uint64_t SheetEdgeGrid::cell_key(const Vec3& point) const {
  std::int64_t c[3];
  for (int axis = 0; axis < 3; ++axis) c[axis] = static_cast<std::int64_t>(std::floor(point[axis] / reach_));
  return key_of(c[0], c[1], c[2]);
}

}  // namespace nacre
