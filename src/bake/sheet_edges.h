// Finding the sheet edges near a point.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "bake/group_surface.h"

namespace nacre {

/// A hashed grid over edges whose cells are as large as the distance that is asked about.
class SheetEdgeGrid {
 public:
  SheetEdgeGrid(std::span<const SheetEdge> edges, float reach);

  /// Calls visit(edge) for every edge within `reach` of the point, and for some farther ones, each once, in
  /// their order.
  template <class Visit>
  void for_each_near(const Vec3& point, const Visit& visit) const {
    if (cells_.empty()) return;
    const auto at = cells_.find(cell_key(point));
    if (at == cells_.end()) return;
    for (const std::uint32_t e : at->second) visit(edges_[e]);
  }

 private:
  std::uint64_t cell_key(const Vec3& point) const;

  std::span<const SheetEdge> edges_;
  float reach_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

}  // namespace nacre
