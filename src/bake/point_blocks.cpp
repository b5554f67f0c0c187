// Gathering what is in and around a block.
#include "bake/point_blocks.h"

namespace nacre {
namespace {

Box3 bounds_of(std::span<const PlacedPoint> points) {
  Box3 box;
  for (const PlacedPoint& point : points) box.extendBy(point.position);
  return box;
}

}  // namespace

PointBlocks::PointBlocks(std::span<const PlacedPoint> points, float reach)
    : points_(points),
      reach_(reach),
      blocks_(bounds_of(points), reach * BlockNeighbourhood::kBlockCells, points.size()) {
  sorted_ = sort_into_buckets(points.size(), blocks_.bucket_count(),
                              [&](std::size_t begin, std::size_t end, const auto& emit) {
                                for (std::size_t i = begin; i < end; ++i)
                                  emit(i, blocks_.bucket(blocks_.at(points_[i].position)));
                              });
  positions_.resize(points.size());
  parallel_for(points.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) positions_[i] = points_[sorted_.items[i]].position;
  });
}

void PointBlocks::find_blocks(std::uint32_t bucket, std::vector<std::uint64_t>& keys) const {
  keys.clear();
  for_each_in_bucket(bucket, [&](std::uint32_t, const Vec3& position) {
    const std::uint64_t key = SpaceBlocks::key(blocks_.at(position));
    if (keys.empty() || keys.back() != key) keys.push_back(key);
  });
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
}

void PointBlocks::gather(const BlockAt& block, BlockNeighbourhood& near) const {
  near.box_.min = blocks_.corner(block);
  near.box_.max = near.box_.min + Vec3(blocks_.size());
  near.inverse_ = 1 / reach_;
  near.own_.clear();
  near.unsorted_.clear();
  near.cells_.clear();
  const auto side = static_cast<float>(BlockNeighbourhood::kBlockCells);
  constexpr float kRounding = 0.01f;
  SpaceBlocks::for_each_around(block, [&](const BlockAt& neighbour) {
    for_each_in_bucket(blocks_.bucket(neighbour), [&](std::uint32_t i, const Vec3& position) {
      const Vec3 at = (position - near.box_.min) * near.inverse_;
      int within = 1;
      for (int axis = 0; axis < 3; ++axis)
        within &= int{at[axis] > -1 - kRounding} & int{at[axis] < side + 1 + kRounding};
      // A bucket may hold other blocks than this one.
      if (within == 0 || blocks_.at(position) != neighbour) return;
      const bool own = neighbour == block;
      if (own) near.own_.push_back(i);
      std::array<int, 3> c;
      for (int axis = 0; axis < 3; ++axis)
        c[static_cast<std::size_t>(axis)] =
            own ? std::clamp(static_cast<int>(at[axis]), 0, BlockNeighbourhood::kBlockCells - 1)
                : std::clamp(static_cast<int>(at[axis] + 1) - 1, -1, BlockNeighbourhood::kBlockCells);
      near.cells_.push_back(static_cast<std::uint16_t>(BlockNeighbourhood::row_of(c[1], c[2]) +
                                                       static_cast<std::size_t>(c[0] + 1)));
      near.unsorted_.push_back(i);
    });
  });
  near.sort_entries(points_);
}

void BlockNeighbourhood::sort_entries(std::span<const PlacedPoint> points) {
  begins_.fill(0);
  for (const std::uint16_t cell : cells_) ++begins_[cell + 1u];
  for (std::size_t c = 1; c < begins_.size(); ++c) begins_[c] += begins_[c - 1];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    entries_.positions[axis].resize(unsorted_.size() + kLanes - 1);
    entries_.normals[axis].resize(unsorted_.size() + kLanes - 1);
  }
  entries_.indices.resize(unsorted_.size());
  // From the back, so that begins end up where they belong without a copy.
  for (std::size_t i = unsorted_.size(); i-- > 0;) {
    const std::size_t to = --begins_[cells_[i] + 1u];
    const PlacedPoint& point = points[unsorted_[i]];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      entries_.positions[axis][to] = point.position[static_cast<int>(axis)];
      entries_.normals[axis][to] = point.normal[static_cast<int>(axis)];
    }
    entries_.indices[to] = unsorted_[i];
  }
  for (std::size_t c = 0; c + 1 < begins_.size(); ++c) begins_[c] = begins_[c + 1];
  begins_.back() = static_cast<std::uint32_t>(entries_.size());
}

}  // namespace nacre
