// Finding the sheet edges near a point.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "bake/group_surface.h"
#include "bake/placement.h"

namespace nacre {

/// A hashed grid over edges whose cells are as large as the distance that is asked about. It has just the
/// cells with points in them, so that edges much longer than that take no memory where nobody asks.
class SheetEdgeGrid {
 public:
  SheetEdgeGrid(std::span<const SheetEdge> edges, std::span<const PlacedPoint> points, float reach);

  /// Calls visit(edge) for every edge within `reach` of one of the points, and for some farther ones, each
  /// once, in their order.
  template <class Visit>
  void for_each_near(const Vec3& point, const Visit& visit) const {
    const auto at = cells_.find(cell_key(cell_of(point)));
    if (at == cells_.end()) return;
    for (const std::uint32_t e : at->second.edges) visit(edges_[e]);
  }

 private:
  using Coordinates = std::array<std::int64_t, 3>;
  struct Cell {
    Coordinates at;
    std::vector<std::uint32_t> edges;
  };
  Coordinates cell_of(const Vec3& point) const;
  static std::uint64_t cell_key(const Coordinates& c);
  void enter(std::uint32_t e);

  std::span<const SheetEdge> edges_;
  float reach_;
  std::unordered_map<std::uint64_t, Cell> cells_;
};

}  // namespace nacre
