// The three channels of a diffusion profile as a table over distance, with bounds on their slope and
// curvature.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "nacre/cache/float4.h"
#include "nacre/optics/profile.h"

namespace nacre {

/// Cells of distance by the bits of r^2 as a float: `shift` of them are dropped.
struct DistanceBins {
  std::int32_t first, last, shift;
};

/// A kernel's tables as the vector code reads them. Interpolated: cells of 8 floats (R of three channels and
/// a spare, their differences to the next cell), and of 16 (R'/r, differences, (R'' - R'/r)/r^2,
/// differences). Else: cells of 4 and of 8, the same without the differences, in the middle of each cell.
struct KernelTables {
  const float *cells, *jets;
  bool interpolated;
  DistanceBins cell_bins, jet_bins;
};

/// R_d and its envelopes, indexed by the bits of r^2 as a float: octaves of r^2, each cut into equal cells.
/// Linear interpolation within a cell is right to 8e-6 relative while sigma_tr r < 1 (there R falls at most
/// like r^-3), and to 1.5e-4 of the value up to sigma_tr r = 15; it never errs below.
class Kernel {
 public:
  enum class Envelopes { kWith, kWithout };
  /// The profiles have to be bounded (resolve_profile). Without envelopes, `bounds` and `bound_bins` are not
  /// to be asked for.
  explicit Kernel(const std::array<Profile, 3>& profiles, Envelopes envelopes = Envelopes::kWith);

  /// R_d at squared distance `r2`.
  Float4 eval(float r2) const noexcept {
    const Cell& cell = cells_[index(r2)];
    return cell.value + broadcast(static_cast<float>(bits(r2) & kFractionMask) * kFractionScale) * cell.delta;
  }
  /// The largest relative error of `eval` up to a distance, which linear interpolation makes where the
  /// profile falls like exp(-sigma_tr r) within a cell.
  double relative_error(float distance) const noexcept;
  /// The same of the derivatives in `eval_jet`.
  double relative_error_of_jets(float distance) const noexcept;
  /// With linear interpolation.
  KernelTables exact_tables() const noexcept;
  /// Without, where `middles` were made: then R errs by up to 0.3 % and its derivatives by up to 3 %, each
  /// way alike, which sums of many terms hardly show; far more where R falls like an exponential.
  KernelTables tables() const noexcept;
  void make_middles();

  /// R with what its Taylor series around a point at squared distance `r2` takes: R'/r, and
  /// (R'' - R'/r)/r^2. As a function of x, R(|x|) has the gradient `radial` x and the Hessian
  /// `bend` x x^T + `radial` I.
  struct Jet {
    Float4 value, radial, bend;
  };
  Jet eval_jet(float r2) const noexcept {
    const JetCell& cell = jets_[clamp_index(bits(r2) >> (23 - kJetBits), first_jet_, jets_.size())];
    const Float4 fraction = broadcast(static_cast<float>(bits(r2) & kJetMask) * kJetScale);
    return {eval(r2), cell.radial + fraction * cell.radial_delta, cell.bend + fraction * cell.bend_delta};
  }

  /// Upper bounds over all distances >= sqrt(r2): of the Hessian's norm, max(|R''|, |R'|/r), of |R'|, and of
  /// the third derivative in any direction.
  struct Bounds {
    Float4 hessian, slope, third;
  };
  const Bounds& bounds(float r2) const noexcept { return bounds_[bound_index(r2)]; }
  /// The cells of `bounds`.
  DistanceBins bound_bins() const noexcept {
    return {static_cast<std::int32_t>(first_bound_),
            static_cast<std::int32_t>(first_bound_ + bounds_.size() - 1), 23 - kBoundBits};
  }

 private:
  static constexpr int kCellBits = 8;   // cells per octave of r^2: 256
  static constexpr int kJetBits = 6;    // cells of derivatives per octave: 64
  static constexpr int kBoundBits = 4;  // bound cells per octave: 16
  static constexpr std::uint32_t kJetMask = (1u << (23 - kJetBits)) - 1;
  static constexpr float kJetScale = 1.0f / static_cast<float>(1u << (23 - kJetBits));
  static constexpr std::uint32_t kFractionMask = (1u << (23 - kCellBits)) - 1;
  static constexpr float kFractionScale = 1.0f / static_cast<float>(1u << (23 - kCellBits));

  struct Cell {
    Float4 value, delta;
  };

  struct JetCell {
    Float4 radial, radial_delta, bend, bend_delta;
  };

  void make_cells(const std::array<Profile, 3>& profiles, std::uint32_t first, std::size_t octaves);
  void make_bounds(const std::array<Profile, 3>& profiles, std::uint32_t first, std::size_t octaves,
                   double start);
  void make_jets(const std::array<Profile, 3>& profiles, std::uint32_t first, std::size_t octaves);

  static std::uint32_t bits(float r2) noexcept { return std::bit_cast<std::uint32_t>(r2); }
  static std::uint32_t clamp_index(std::uint32_t i, std::uint32_t first, std::size_t size) noexcept {
    if (i < first) return 0;
    return std::min(i - first, static_cast<std::uint32_t>(size) - 1);
  }
  std::uint32_t index(float r2) const noexcept {
    return clamp_index(bits(r2) >> (23 - kCellBits), first_cell_, cells_.size());
  }
  std::uint32_t bound_index(float r2) const noexcept {
    return clamp_index(bits(r2) >> (23 - kBoundBits), first_bound_, bounds_.size());
  }

  std::vector<Cell> cells_;  // first: below the table's start; last: beyond its end, zero
  std::vector<Bounds> bounds_;
  std::vector<JetCell> jets_;
  std::vector<Float4> cell_middles_, jet_middles_;
  std::uint32_t first_cell_ = 0, first_bound_ = 0, first_jet_ = 0;
  double steepest_ = 0;  // largest sigma of a profile's exponentials
};

}  // namespace nacre
