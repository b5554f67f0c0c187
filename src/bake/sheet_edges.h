// Finding the sheet edges near a point.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bake/group_surface.h"

namespace nacre {

/// A complete binary tree of boxes over edges along a Morton curve: its size is that of the edges, however
/// long they are.
class SheetEdgeTree {
 public:
  explicit SheetEdgeTree(std::span<const SheetEdge> edges);

  /// Calls visit(edge), in an order that depends on the edges alone, for every edge that comes into the box,
  /// and for some that only come near it.
  template <class Visit>
  void for_each_in(const Box3& box, const Visit& visit) const {
    if (edges_.empty()) return;
    std::array<std::uint32_t, 64> stack;
    std::size_t depth = 0;
    stack[depth++] = 1;
    while (depth > 0) {
      const std::uint32_t node = stack[--depth];
      if (!bounds_[node].intersects(box)) continue;
      if (node < leaf_count_) {
        stack[depth++] = 2 * node + 1;
        stack[depth++] = 2 * node;
        continue;
      }
      const std::size_t begin = kLeafEdges * static_cast<std::size_t>(node - leaf_count_);
      for (std::size_t i = begin; i < std::min(begin + kLeafEdges, edges_.size()); ++i) visit(edges_[i]);
    }
  }
  bool any_in(const Box3& box) const {
    bool any = false;
    for_each_in(box, [&](const SheetEdge&) { any = true; });
    return any;
  }

 private:
  static constexpr std::size_t kLeafEdges = 4;
  std::vector<SheetEdge> edges_;
  std::uint32_t leaf_count_ = 0;  // a power of two; the leaves follow the inner nodes, which begin at 1
  std::vector<Box3> bounds_;
};

}  // namespace nacre
