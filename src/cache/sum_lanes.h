// The inner loops of the hierarchical sum, for whatever vector instructions the processor has.
#pragma once

#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "cache/local_expansion.h"
#include "nacre/cache/exitance.h"
#include "nacre/cache/kernel.h"

namespace nacre {

/// Floats of a cache line: a vector that lies in two of them takes twice as long to read.
struct alignas(64) Line {
  std::array<float, 16> floats;
};
/// So many floats, from the beginning of a line on.
class AlignedFloats {
 public:
  void resize(std::size_t size) { lines_.resize((size + 15) / 16); }
  std::size_t size() const noexcept { return 16 * lines_.size(); }
  float* data() noexcept { return reinterpret_cast<float*>(lines_.data()); }
  const float* data() const noexcept { return reinterpret_cast<const float*>(lines_.data()); }

 private:
  std::vector<Line> lines_;
};

/// Sources side by side, coordinates field by field, padded with dark ones to whole vectors.
class SourceList {
 public:
  void clear() noexcept { size_ = 0; }
  void add(const SumSource& source);
  /// Room for `count` more and for what a vector store may spill; `grow` says how many were written.
  void reserve(std::size_t count);
  void grow(std::size_t count) noexcept { size_ += count; }
  std::size_t size() const noexcept { return size_; }
  /// Has to be called between the last `add` and a sum.
  void pad();

  enum Field { kX, kY, kZ, kFieldCount };
  const float* field(Field f) const noexcept { return fields_[f].data(); }
  float* field(Field f) noexcept { return fields_[f].data(); }
  const Float4* powers() const noexcept { return powers_.data(); }
  Float4* powers() noexcept { return powers_.data(); }
  /// Copies for each source the row of `width` floats that its power's fourth channel numbers: side by side
  /// they are read as fast as powers. After `pad`.
  void copy_rows(const float* rows, std::size_t width);
  const float* rows() const noexcept { return rows_.data(); }

 private:
  std::array<std::vector<float>, kFieldCount> fields_;
  std::vector<Float4> powers_;
  AlignedFloats rows_;
  std::size_t size_ = 0;
};

/// The row that a power is that of, kept where a fourth channel would be.
inline std::uint32_t power_row(const Float4& power) noexcept {
  return std::bit_cast<std::uint32_t>(power[3]);
}
inline Float4 with_row(Float4 power, std::uint32_t row) noexcept {
  power[3] = std::bit_cast<float>(row);
  return power;
}

/// Indices of nodes, written a vector at a time.
class IndexList {
 public:
  std::size_t size() const noexcept { return size_; }
  const std::uint32_t* data() const noexcept { return indices_.data(); }
  std::span<const std::uint32_t> span() const noexcept { return {indices_.data(), size_}; }
  void clear() noexcept { size_ = 0; }
  void push(std::uint32_t index) {
    if (size_ >= indices_.size()) indices_.resize(2 * size_ + 64);
    indices_[size_++] = index;
  }
  /// `first` and those that follow it.
  void push_run(std::uint32_t first, std::uint32_t count) {
    std::uint32_t* const to = room(count);
    // Runs are short: eight at once, wanted or not, is faster than to count.
    constexpr std::uint32_t kMostly = 8;
    for (std::uint32_t i = 0; i < kMostly; ++i) to[i] = first + i;
    for (std::uint32_t i = kMostly; i < count; ++i) to[i] = first + i;
    size_ += count;
  }
  void append(std::span<const std::uint32_t> from) {
    std::copy(from.begin(), from.end(), room(from.size()));
    size_ += from.size();
  }
  /// Room for `count` more and for what a vector store may spill; `grow` says how many were written.
  std::uint32_t* room(std::size_t count) {
    if (indices_.size() < size_ + count + 64) indices_.resize(2 * (size_ + count) + 64);
    return indices_.data() + size_;
  }
  void grow(std::size_t count) noexcept { size_ += count; }
  /// Repeats the last index, so that whole vectors may be read.
  void pad() {
    if (size_ == 0) return;
    const std::uint32_t last = indices_[size_ - 1];
    std::fill_n(room(64), 64, last);
  }

 private:
  std::vector<std::uint32_t> indices_;
  std::size_t size_ = 0;
};

/// What nodes at some distance are measured against: what first and second moments count against the third,
/// and the largest of their sum that a point, a series may stand for.
struct Limits {
  float lean, bend, as_point, in_series;
};

/// What one channel of a kernel allows, by bin: `share` of the sum times the first, and the node's own
/// contribution as a point, in a series.
struct LimitTerm {
  float share;
  const float *per_share, *as_point, *in_series;
};

/// How a target looks at nodes.
struct NodeTest {
  const SumNode* nodes;
  Vec3 centre;           // of the target
  float radius;          // of a ball around all its points
  bool open_small;       // whether nodes smaller than the target are opened rather than left to its parts
  bool certified;        // whether distances are to the nearest that a sample of the node may be
  float ratio;           // the largest of a node's radius to its distance
  float reach, third;    // what the spread counts, and that times the node's radius
  DistanceBins bins;     // of the limits
  const Limits* limits;  // by bin
};

/// How the sum is guessed, or bounded from below.
struct CoarseTest {
  const SumNode* nodes;
  Vec3 centre;
  float ratio;     // of radius to distance above which nodes with children are opened
  bool certified;  // whether samples are as far away as can be
  float slack;     // then: how much further
};

/// Where the nodes of `work` belong: `far`, a series is good enough; `points`, a point is; `scattered`, it is
/// for each of their samples; `opened`, none of these; `pending`, neither, but they are left to the target's
/// parts. Dark nodes are dropped.
struct SortedNodes {
  IndexList work, far, points, scattered, opened, pending;
  IndexList samples, far_samples;  // of opened leaves, and those that a series is good enough for
};

namespace lanes {

/// Adds sum R_d(|x - p|) P over a padded list to `total`.
void add_sources(const KernelTables& kernel, const SourceList& list, const Vec3& x,
                 std::array<double, 3>& total);
void sort_nodes(const NodeTest& test, SortedNodes& lists);
/// The same for `samples`: `far_samples`, or the list.
void sort_samples(const NodeTest& test, const SumSource* sources, SortedNodes& lists, SourceList& near);
/// Adds nodes with their second moments, samples, to the Taylor series of a target.
void add_series(const KernelTables& kernel, const SumNode* nodes, std::span<const std::uint32_t> far,
                const Vec3& centre, LocalExpansion& expansion);
void add_series(const KernelTables& kernel, const SumSource* sources, std::span<const std::uint32_t> far,
                const Vec3& centre, LocalExpansion& expansion);
/// Adds R_d P of the nodes of `work` to the total of each of at most kMostCoarse kernels, all interpolated or
/// none; nodes seen under too large an angle go to `opened`. Returns how many terms were added.
inline constexpr std::size_t kMostCoarse = 4;
std::uint64_t add_coarsely(std::span<const KernelTables> kernels, const CoarseTest& test, SortedNodes& lists,
                           std::span<Float4> totals);
/// Limits of `count` bins: `lean` and `bend` as they are, and the least that any of `terms` allows, times
/// `scale`. Whole vectors are read and written.
void make_limits(std::span<const LimitTerm> terms, const float* lean, const float* bend, float scale,
                 std::size_t count, Limits* limits);

}  // namespace lanes
}  // namespace nacre
