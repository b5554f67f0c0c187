// The kernels of several materials side by side.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "cache/sum_lanes.h"
#include "nacre/cache/kernel.h"
#include "nacre/cache/material_family.h"

namespace nacre {

/// The light that each kernel of a set sees, by channel: numbers from 0 on.
using KernelLights = std::vector<std::array<std::uint32_t, 3>>;

/// Tables of a KernelTables' layout, in which each field holds `width` floats instead of four: a lane for
/// each channel of each kernel, those of the first channel before the others', padded to whole steps. A row
/// reads the same for a lane, whichever others there are.
class KernelSet {
 public:
  enum class Tables { kAny, kExact };  // as they are, or interpolated
  /// The first `counts[k]` kernels take part in channel k. All are interpolated or none; no fewer than one.
  /// Without `lights` all see the same.
  KernelSet(std::span<const Kernel> kernels, const std::array<std::size_t, 3>& counts, Tables which,
            const KernelLights& lights = {});

  std::size_t width() const noexcept { return columns_.size(); }
  /// The lanes of a channel are `first(k)` up to `first(k + 1)`.
  std::size_t first(std::size_t channel) const noexcept { return first_[channel]; }
  /// Of powers under all lights: a row for each node or source, and which float of it a lane sees. A few
  /// lights lie side by side, four floats each, in rows of kFewColumns; of more, rows have the lanes' own.
  /// All other floats are 0. Of a single light the row is its power, without the fourth channel.
  enum class Rows { kPower, kFewLights, kLanes };
  Rows rows() const noexcept { return rows_; }
  std::size_t row_width() const noexcept;
  const std::uint32_t* columns() const noexcept { return columns_.data(); }
  static constexpr std::size_t kFewColumns = 16;
  /// Calls `action` with the columns that lanes see of a light, and their channels; some more than once.
  template <class Action>
  void for_each_column(std::uint32_t light, const Action& action) const {
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t lane = first(k); lane < first(k + 1); ++lane)
        if (lights_[lane] == light) action(std::size_t{columns_[lane]}, k);
  }
  bool interpolated() const noexcept { return interpolated_; }
  const float* cells() const noexcept { return cells_.data(); }
  const float* jets() const noexcept { return jets_.data(); }
  const DistanceBins& cell_bins() const noexcept { return cell_bins_; }
  const DistanceBins& jet_bins() const noexcept { return jet_bins_; }

  /// Floats that `width` is a multiple of; vectors are of as many or twice as many, where there are any.
  static constexpr std::size_t kStep = 8;

 private:
  struct Table;
  AlignedFloats interleave(std::span<const Table> tables, std::size_t fields, DistanceBins& bins) const;

  std::array<std::size_t, 4> first_;
  std::vector<std::uint32_t> columns_, lights_;
  Rows rows_;
  bool interpolated_;
  AlignedFloats cells_, jets_;
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

namespace lanes {

/// As for a single kernel; `totals` has `width` sums. Where there are several lights, `powers` are rows of
/// the set's row_width, one for each node or source, and lists have copied theirs; else nullptr, and the
/// fourth channel of all powers has to be 0.
void add_sources(const KernelSet& set, const SourceList& list, const Vec3& x, std::span<double> totals);
void add_series(const KernelSet& set, const SumNode* nodes, const float* powers,
                std::span<const std::uint32_t> far, const Vec3& centre, SetExpansion& expansion);
void add_series(const KernelSet& set, const SumSource* sources, const float* powers,
                std::span<const std::uint32_t> far, const Vec3& centre, SetExpansion& expansion);

}  // namespace lanes
}  // namespace nacre
