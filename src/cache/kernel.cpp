// Tabulating a profile.
#include "nacre/cache/kernel.h"

#include <algorithm>
#include <cmath>

#include "nacre/base/parallel.h"

namespace nacre {
namespace {

float r2_of_bits(std::uint32_t bits) { return std::bit_cast<float>(bits); }

}  // namespace

Kernel::Kernel(const std::array<Profile, 3>& profiles, Envelopes envelopes) {
  double narrowest = 1e30, widest = 0;
  for (const Profile& p : profiles) {
    if (p.total <= 0) continue;
    narrowest = std::min(narrowest, p.width);
    // Beyond 104 decay lengths exp underflows what a float can hold next to the centre's value; without
    // absorption R falls like r^-3 and what lies beyond 1e6 widths is some 1e-6 of the total.
    for (const Profile::Term& t : p.terms) {
      steepest_ = std::max(steepest_, t.sigma);
      widest = std::max(widest, t.sigma > 0 ? std::min(104 / t.sigma, 1e6 * p.width) : 1e6 * p.width);
    }
  }
  if (widest == 0) narrowest = widest = 1;
  // The start is so near that a bounded profile is flat there to the accuracy of the table.
  const double start = narrowest * 0x1p-10;
  const std::uint32_t first = bits(static_cast<float>(std::max(start * start, 1e-36))) >> 23;
  const std::uint32_t last = bits(static_cast<float>(std::min(widest * widest, 1e36))) >> 23;

  const auto octaves = static_cast<std::size_t>(last - first) + 1;
  make_cells(profiles, first, octaves);
  if (envelopes == Envelopes::kWith) make_bounds(profiles, first, octaves, start);
  make_jets(profiles, first, octaves);
}

// Cells are evaluated at their near edges, side by side, then joined.
void Kernel::make_cells(const std::array<Profile, 3>& profiles, std::uint32_t first, std::size_t octaves) {
  first_cell_ = (first << kCellBits) - 1;
  cells_.resize((octaves << kCellBits) + 2);
  const std::size_t count = cells_.size() - 1;
  parallel_for(count - 1, 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin + 1; i < end + 1; ++i) {
      const double r =
          std::sqrt(double{r2_of_bits((first_cell_ + static_cast<std::uint32_t>(i)) << (23 - kCellBits))});
      for (std::size_t k = 0; k < 3; ++k)
        cells_[i].value[k] = static_cast<float>(eval_profile(profiles[k], r));
    }
  });
  cells_[0].value = cells_[1].value;
  cells_[0].delta = broadcast(0);
  const double end =
      std::sqrt(double{r2_of_bits((first_cell_ + static_cast<std::uint32_t>(count)) << (23 - kCellBits))});
  Float4 beyond = broadcast(0);
  for (std::size_t k = 0; k < 3; ++k) beyond[k] = static_cast<float>(eval_profile(profiles[k], end));
  for (std::size_t i = 1; i < count; ++i)
    cells_[i].delta = (i + 1 < count ? cells_[i + 1].value : beyond) - cells_[i].value;
  cells_[count].value = cells_[count].delta = broadcast(0);
}

// Bounds per cell are taken at its near edge and made monotone from the far end; the maximum within a cell is
// at most a little above that at its edges, which eight points inside find, with 2 % to spare.
void Kernel::make_bounds(const std::array<Profile, 3>& profiles, std::uint32_t first, std::size_t octaves,
                         double start) {
  first_bound_ = (first << kBoundBits) - 1;
  bounds_.resize((octaves << kBoundBits) + 2);
  const auto at_most = [](double x) { return static_cast<float>(std::min(x, 1e30)); };
  parallel_for(bounds_.size() - 1, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto near_bits = (first_bound_ + static_cast<std::uint32_t>(i)) << (23 - kBoundBits);
      const double low = i == 0 ? 0 : std::sqrt(double{r2_of_bits(near_bits)});
      const double high = std::sqrt(double{r2_of_bits(near_bits + (1u << (23 - kBoundBits)))});
      for (std::size_t k = 0; k < 3; ++k) {
        double hessian = 0, slope = 0, third = 0;
        for (int step = 0; step <= 8; ++step) {
          const double r = std::max(low + (high - low) * step / 8, 1e-3 * start);
          const ProfileValue v = eval_profile_derivatives(profiles[k], r);
          hessian = std::max({hessian, std::abs(v.curvature), std::abs(v.slope) / r});
          slope = std::max(slope, std::abs(v.slope));
          // Along the radius by differences; of c s^2, that of an angle, the most is 2 / sqrt(27).
          const double h = 1e-3 * r;
          const double along = (eval_profile_derivatives(profiles[k], r + h).curvature -
                                eval_profile_derivatives(profiles[k], r - h).curvature) /
                               (2 * h);
          const double across = (v.curvature - v.slope / r) / r;
          third = std::max(third, std::abs(along) + 2 / std::sqrt(3.0) * std::abs(across));
        }
        bounds_[i].hessian[k] = at_most(1.02 * hessian);
        bounds_[i].slope[k] = at_most(1.02 * slope);
        bounds_[i].third[k] = at_most(1.05 * third);
      }
    }
  });
  for (std::size_t i = bounds_.size() - 1; i-- > 0;)
    for (std::size_t k = 0; k < 3; ++k) {
      const Bounds& far = bounds_[i + 1];
      bounds_[i].hessian[k] = std::max(bounds_[i].hessian[k], far.hessian[k]);
      bounds_[i].slope[k] = std::max(bounds_[i].slope[k], far.slope[k]);
      bounds_[i].third[k] = std::max(bounds_[i].third[k], far.third[k]);
    }
}

// The cell before the table's start holds what is there, flat.
void Kernel::make_jets(const std::array<Profile, 3>& profiles, std::uint32_t first, std::size_t octaves) {
  first_jet_ = (first << kJetBits) - 1;
  jets_.resize((octaves << kJetBits) + 2);
  const std::size_t count = jets_.size() - 1;
  parallel_for(count, 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto bits = (first_jet_ + static_cast<std::uint32_t>(std::max<std::size_t>(i, 1)))
                        << (23 - kJetBits);
      const double r = std::sqrt(double{r2_of_bits(bits)});
      for (std::size_t k = 0; k < 3; ++k) {
        const ProfileValue v = eval_profile_derivatives(profiles[k], r);
        jets_[i].radial[k] = static_cast<float>(std::clamp(v.slope / r, -1e30, 1e30));
        jets_[i].bend[k] =
            static_cast<float>(std::clamp((v.curvature - v.slope / r) / square(r), -1e30, 1e30));
      }
    }
  });
  for (std::size_t i = 0; i + 1 < count; ++i) {
    jets_[i].radial_delta = jets_[i + 1].radial - jets_[i].radial;
    jets_[i].bend_delta = jets_[i + 1].bend - jets_[i].bend;
  }
  jets_[count - 1].radial_delta = jets_[count - 1].bend_delta = broadcast(0);
  jets_[count] = {broadcast(0), broadcast(0), broadcast(0), broadcast(0)};
}

KernelTables Kernel::exact_tables() const noexcept {
  static_assert(sizeof(Cell) == 8 * sizeof(float) && sizeof(JetCell) == 16 * sizeof(float));
  const auto bins = [](std::uint32_t first, std::size_t count, int shift) {
    return DistanceBins{static_cast<std::int32_t>(first), static_cast<std::int32_t>(first + count - 1),
                        shift};
  };
  return {reinterpret_cast<const float*>(cells_.data()), reinterpret_cast<const float*>(jets_.data()), true,
          bins(first_cell_, cells_.size(), 23 - kCellBits), bins(first_jet_, jets_.size(), 23 - kJetBits)};
}

KernelTables Kernel::tables() const noexcept {
  KernelTables tables = exact_tables();
  if (cell_middles_.empty()) return tables;
  tables.cells = reinterpret_cast<const float*>(cell_middles_.data());
  tables.jets = reinterpret_cast<const float*>(jet_middles_.data());
  tables.interpolated = false;
  return tables;
}

void Kernel::make_middles() {
  const Float4 half = broadcast(0.5f);
  for (const Cell& cell : cells_) cell_middles_.push_back(cell.value + half * cell.delta);
  for (const JetCell& jet : jets_) {
    jet_middles_.push_back(jet.radial + half * jet.radial_delta);
    jet_middles_.push_back(jet.bend + half * jet.bend_delta);
  }
}

namespace {

// As a function of s = r^2 the profile falls locally like a power, at most (3 + sigma r)/2, and over a cell
// of width h s a chord errs by at most h^2/8 of s^2 R''/R. A tenth is added for rounding of the cells' ends.
double error_of_chords(int bits, double power) {
  return 1.1 * square(1.0 / (1 << bits)) / 8 * power * (power + 1);
}

}  // namespace

double Kernel::relative_error(float distance) const noexcept {
  return error_of_chords(kCellBits, (3 + std::min(steepest_ * double{distance}, 80.0)) / 2);
}

// They fall by up to four powers of r more.
double Kernel::relative_error_of_jets(float distance) const noexcept {
  return error_of_chords(kJetBits, (7 + std::min(steepest_ * double{distance}, 80.0)) / 2);
}

}  // namespace nacre
