// Sorting edges along a Morton curve and bounding them bottom-up.
#include "bake/sheet_edges.h"

#include <algorithm>
#include <bit>

#include "cache/morton.h"
#include "nacre/base/parallel.h"

namespace nacre {
namespace {

struct Keyed {
  std::uint64_t code;
  std::uint32_t index;
};

std::vector<Keyed> sort_along_curve(std::span<const SheetEdge> edges) {
  Box3 box;
  for (const SheetEdge& edge : edges) box.extendBy((edge.a + edge.b) * 0.5f);
  const Vec3 size = box.size();
  const float extent = std::max({size.x, size.y, size.z});
  const float to_cells = extent > 0 ? 0x1p21f / extent : 0;
  std::vector<Keyed> keyed(edges.size());
  parallel_for(edges.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 at = ((edges[i].a + edges[i].b) * 0.5f - box.min) * to_cells;
      std::uint64_t code = 0;
      for (int axis = 0; axis < 3; ++axis)
        code |= spread_bits(static_cast<std::uint64_t>(std::clamp(at[axis], 0.0f, 0x1p21f - 1))) << axis;
      keyed[i] = {code, static_cast<std::uint32_t>(i)};
    }
  });
  parallel_sort(keyed.begin(), keyed.end(), [](const Keyed& a, const Keyed& b) {
    return a.code != b.code ? a.code < b.code : a.index < b.index;
  });
  return keyed;
}

}  // namespace

SheetEdgeTree::SheetEdgeTree(std::span<const SheetEdge> edges) {
  if (edges.empty()) return;
  edges_.reserve(edges.size());
  for (const Keyed& keyed : sort_along_curve(edges)) edges_.push_back(edges[keyed.index]);
  leaf_count_ = std::bit_ceil(static_cast<std::uint32_t>((edges_.size() + kLeafEdges - 1) / kLeafEdges));
  bounds_.resize(2 * static_cast<std::size_t>(leaf_count_));  // empty boxes
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    Box3& leaf = bounds_[leaf_count_ + i / kLeafEdges];
    leaf.extendBy(edges_[i].a);
    leaf.extendBy(edges_[i].b);
  }
  for (std::size_t node = leaf_count_; --node > 0;) {
    bounds_[node].extendBy(bounds_[2 * node]);
    bounds_[node].extendBy(bounds_[2 * node + 1]);
  }
}

}  // namespace nacre
