// Points sorted into blocks of space, and all that is near each of them.
#pragma once

#include <span>
#include <vector>

#include "bake/placement.h"
#include "bake/space_blocks.h"

namespace nacre {

/// The points in one block and those within one cell of it, in a dense grid.
class BlockNeighbourhood {
 public:
  static constexpr std::size_t kLanes = 4;
  /// Everything about the points, cell by cell, in arrays of their own, where kLanes values can be read from
  /// any entry on.
  struct Entries {
    std::array<std::vector<float>, 3> positions, normals;
    std::vector<std::uint32_t> indices;  // of the points

    std::size_t size() const { return indices.size(); }
    Vec3 position(std::size_t i) const { return {positions[0][i], positions[1][i], positions[2][i]}; }
    Vec3 normal(std::size_t i) const { return {normals[0][i], normals[1][i], normals[2][i]}; }
  };

  /// The points of the block itself.
  std::span<const std::uint32_t> own() const { return own_; }
  const Box3& box() const { return box_; }
  const Entries& entries() const { return entries_; }
  /// Calls visit(begin, end) for ranges of entries that hold all points within `reach` of a point of the
  /// block, and some farther ones.
  template <class Visit>
  void for_each_range_near(const Vec3& position, const Visit& visit) const {
    const std::array<int, 3> c = cell_of(position);
    for (int z = c[2] - 1; z <= c[2] + 1; ++z)
      for (int y = c[1] - 1; y <= c[1] + 1; ++y) {
        // Three cells in a row are one range.
        const std::size_t row = row_of(y, z) + static_cast<std::size_t>(c[0]);
        if (begins_[row] < begins_[row + 3]) visit(std::size_t{begins_[row]}, std::size_t{begins_[row + 3]});
      }
  }

 private:
  friend class PointBlocks;
  static constexpr int kBlockCells = 6;
  static constexpr int kSide = kBlockCells + 2;

  std::array<int, 3> cell_of(const Vec3& position) const {
    std::array<int, 3> c;
    for (int axis = 0; axis < 3; ++axis)
      c[static_cast<std::size_t>(axis)] =
          std::clamp(static_cast<int>((position[axis] - box_.min[axis]) * inverse_), 0, kBlockCells - 1);
    return c;
  }
  // Of the cell before the first.
  static std::size_t row_of(int y, int z) {
    return static_cast<std::size_t>(((z + 1) * kSide + y + 1) * kSide);
  }
  void sort_entries(std::span<const PlacedPoint> points);

  Box3 box_;
  float inverse_ = 0;
  std::vector<std::uint32_t> own_;
  Entries entries_;
  std::vector<std::uint32_t> unsorted_;
  std::vector<std::uint16_t> cells_;  // of those
  std::array<std::uint32_t, kSide * kSide * kSide + 1> begins_{};
};

class PointBlocks {
 public:
  /// `reach` is how far the points of a block look around them, a cell's side.
  PointBlocks(std::span<const PlacedPoint> points, float reach);

  /// Calls visit(neighbourhood) for every block with points in it, on all threads. Points come in an order
  /// that depends on them alone.
  template <class Visit>
  void for_each_block(const Visit& visit) const {
    parallel_for(blocks_.bucket_count(), 8, [&](std::size_t begin, std::size_t end) {
      BlockNeighbourhood near;
      std::vector<std::uint64_t> keys;
      for (std::size_t b = begin; b < end; ++b) {
        find_blocks(static_cast<std::uint32_t>(b), keys);
        for (const std::uint64_t key : keys) {
          gather(SpaceBlocks::from_key(key), near);
          visit(near);
        }
      }
    });
  }
  /// Calls visit(point index) for all points of the block around a point of it and of the 26 next to that.
  template <class Visit>
  void for_each_around(const BlockNeighbourhood& near, const Visit& visit) const {
    SpaceBlocks::for_each_around(blocks_.at(points_[near.own().front()].position), [&](const BlockAt& block) {
      for_each_in_bucket(blocks_.bucket(block), [&](std::uint32_t i, const Vec3& position) {
        if (blocks_.at(position) == block) visit(i);
      });
    });
  }

 private:
  void find_blocks(std::uint32_t bucket, std::vector<std::uint64_t>& keys) const;
  void gather(const BlockAt& block, BlockNeighbourhood& near) const;
  template <class Visit>
  void for_each_in_bucket(std::uint32_t bucket, const Visit& visit) const {
    const std::span<const std::uint32_t> items = sorted_.of(bucket);
    const Vec3* positions = positions_.data() + (items.data() - sorted_.items.data());
    for (std::size_t k = 0; k < items.size(); ++k) visit(items[k], positions[k]);
  }

  std::span<const PlacedPoint> points_;
  float reach_;
  SpaceBlocks blocks_;
  Buckets sorted_;
  std::vector<Vec3> positions_;  // in that order, since each is read for all the blocks around its own
};

}  // namespace nacre
