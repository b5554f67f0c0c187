// The kernels of several materials side by side.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "cache/sum_lanes.h"
#include "nacre/cache/kernel.h"
#include "nacre/cache/material_family.h"

namespace nacre {

/// Tables of a KernelTables' layout, in which each field holds `width` floats instead of four: a lane for
/// each channel of each kernel, those of the first channel before the others', padded to whole steps. A row
/// reads the same for a lane, whichever others there are.
class KernelSet {
 public:
  enum class Tables { kAny, kExact };  // as they are, or interpolated
  /// The first `counts[k]` kernels take part in channel k. All are interpolated or none; no fewer than one.
  KernelSet(std::span<const Kernel> kernels, const std::array<std::size_t, 3>& counts, Tables which);

  std::size_t width() const noexcept { return channels_.size(); }
  /// The lanes of a channel are `first(k)` up to `first(k + 1)`.
  std::size_t first(std::size_t channel) const noexcept { return first_[channel]; }
  /// Of each lane.
  const std::uint32_t* channels() const noexcept { return channels_.data(); }
  bool interpolated() const noexcept { return interpolated_; }
  const float* cells() const noexcept { return cells_.data(); }
  const float* jets() const noexcept { return jets_.data(); }
  const DistanceBins& cell_bins() const noexcept { return cell_bins_; }
  const DistanceBins& jet_bins() const noexcept { return jet_bins_; }

  /// Floats that `width` is a multiple of; vectors are of as many or twice as many, where there are any.
  static constexpr std::size_t kStep = 8;

 private:
  struct Table;
  std::vector<float> interleave(std::span<const Table> tables, std::size_t fields, DistanceBins& bins) const;

  std::array<std::size_t, 4> first_;
  std::vector<std::uint32_t> channels_;  // 3 where it is padded
  bool interpolated_;
  std::vector<float> cells_, jets_;
  DistanceBins cell_bins_{}, jet_bins_{};
};

/// A LocalExpansion for each kernel of a set: its ten coefficients, each of `width` floats as the set's
/// tables have them.
class SetExpansion {
 public:
  enum Coefficient { kValue, kX, kY, kZ, kXX, kYY, kZZ, kYZ, kZX, kXY, kCoefficients };
  void clear(std::size_t width) { coefficients_.assign(kCoefficients * width, 0.0f); }
  float* data() noexcept { return coefficients_.data(); }
  /// The same functions around another point, `by` from where they are.
  void move_from(const SetExpansion& other, const Vec3& by);
  /// Their values there; `values` has `width` floats.
  void eval(const Vec3& at, std::span<float> values) const;

 private:
  std::vector<float> coefficients_;
};

/// The row that a power is that of, kept where a fourth channel would be.
inline std::uint32_t power_row(const Float4& power) noexcept {
  return std::bit_cast<std::uint32_t>(power[3]);
}
inline Float4 with_row(Float4 power, std::uint32_t row) noexcept {
  power[3] = std::bit_cast<float>(row);
  return power;
}

namespace lanes {

/// As for a single kernel; `totals` has `width` sums. Where kernels have a light each, `powers` are rows of
/// `width` floats, one for each node or source, and in lists that of power_row; else nullptr, and the fourth
/// channel of all powers has to be 0.
void add_sources(const KernelSet& set, const SourceList& list, const float* powers, const Vec3& x,
                 std::span<double> totals);
void add_series(const KernelSet& set, const SumNode* nodes, const float* powers,
                std::span<const std::uint32_t> far, const Vec3& centre, SetExpansion& expansion);
void add_series(const KernelSet& set, const SumSource* sources, const float* powers,
                std::span<const std::uint32_t> far, const Vec3& centre, SetExpansion& expansion);

}  // namespace lanes
}  // namespace nacre
