// Tabulating a profile; averages of 1/r over discs.
#include "nacre/cache/kernel.h"

#include <algorithm>
#include <cmath>

namespace nacre {
namespace {

// Mean of 1/|x - y| over y in the unit disc, for |x| = t: complete elliptic integrals. Source: Lass & Blitzer
// 1983.
double mean_inverse_distance(double t) {
  if (t <= 1) return 4 / kPiD * std::comp_ellint_2(std::min(t, 1.0));
  const double k = 1 / t;
  return 4 / kPiD * t * (std::comp_ellint_2(k) - (1 - k * k) * std::comp_ellint_1(k));
}

// The same as a table over t in [0, kDiscReach]; beyond, 1/t is right to 1 %.
constexpr int kDiscCells = 1024;
const std::array<float, kDiscCells + 1>& disc_table() {
  static const auto table = [] {
    std::array<float, kDiscCells + 1> values{};
    for (int i = 0; i <= kDiscCells; ++i) {
      // The singularity of K at t = 1 cancels; stay off it.
      const double t = static_cast<double>(Kernel::kDiscReach) * i / kDiscCells;
      values[static_cast<std::size_t>(i)] =
          static_cast<float>(mean_inverse_distance(std::abs(t - 1) < 1e-9 ? 1.0 : t));
    }
    return values;
  }();
  return table;
}

struct JetValues {
  double radial, bend;
};

float r2_of_bits(std::uint32_t bits) { return std::bit_cast<float>(bits); }

}  // namespace

Kernel::Kernel(const std::array<Profile, 3>& profiles) {
  double narrowest = 1e30, widest = 0;
  for (const Profile& p : profiles) {
    singular_ = singular_ || p.singular();
    if (p.total <= 0) continue;
    narrowest = std::min(narrowest, p.width);
    // Beyond 80 decay lengths exp underflows what a float can hold next to the centre's value; without
    // absorption R falls like r^-3 and what lies beyond 1e6 widths is some 1e-6 of the total.
    for (const Profile::Term& t : p.terms) {
      steepest_ = std::max(steepest_, t.sigma);
      widest = std::max(widest, t.sigma > 0 ? std::min(80 / t.sigma, 1e6 * p.width) : 1e6 * p.width);
    }
  }
  if (widest == 0) narrowest = widest = 1;
  // The start is so near that a regular profile is flat there to the accuracy of the table.
  const double start = narrowest * (singular_ ? 0x1p-24 : 0x1p-10);
  const std::uint32_t first = bits(static_cast<float>(std::max(start * start, 1e-36))) >> 23;
  const std::uint32_t last = bits(static_cast<float>(std::min(widest * widest, 1e36))) >> 23;

  first_cell_ = (first << kCellBits) - 1;
  const std::size_t cell_count = (static_cast<std::size_t>(last - first) + 1) << kCellBits;
  cells_.resize(cell_count + 2);
  const auto value_at = [&](std::size_t channel, double r) { return eval_profile(profiles[channel], r); };
  for (std::size_t k = 0; k < 3; ++k) {
    double previous = 0;
    for (std::size_t i = 0; i <= cell_count; ++i) {
      const auto edge_bits = static_cast<std::uint32_t>((first_cell_ + 1 + i) << (23 - kCellBits));
      const double value = value_at(k, std::sqrt(static_cast<double>(r2_of_bits(edge_bits))));
      if (i == 0) {
        cells_[0].value[k] = static_cast<float>(value);
        cells_[0].delta[k] = 0;
      } else {
        cells_[i].value[k] = static_cast<float>(previous);
        cells_[i].delta[k] = static_cast<float>(value - previous);
      }
      previous = value;
    }
  }

  // Bounds per cell are taken at its near edge and made monotone from the far end; the maximum within a cell
  // is at most a little above that at its edges, which eight points inside find, with 2 % to spare.
  first_bound_ = (first << kBoundBits) - 1;
  const std::size_t bound_count = (static_cast<std::size_t>(last - first) + 1) << kBoundBits;
  bounds_.resize(bound_count + 2);
  for (std::size_t k = 0; k < 3; ++k) {
    double hessian = 0, slope = 0, third = 0;
    for (std::size_t i = bound_count + 1; i-- > 0;) {
      const auto near_bits = static_cast<std::uint32_t>((first_bound_ + i) << (23 - kBoundBits));
      const double low = i == 0 ? 0 : std::sqrt(static_cast<double>(r2_of_bits(near_bits)));
      const double high = std::sqrt(static_cast<double>(r2_of_bits(near_bits + (1u << (23 - kBoundBits)))));
      for (int step = 0; step <= 8; ++step) {
        const double r = std::max(low + (high - low) * step / 8, 1e-3 * start);
        const ProfileValue v = eval_profile_derivatives(profiles[k], r);
        hessian = std::max({hessian, 1.02 * std::abs(v.curvature), 1.02 * std::abs(v.slope) / r});
        slope = std::max(slope, 1.02 * std::abs(v.slope));
        // Along the radius by differences; of c s^2, that of an angle, the most is 2 / sqrt(27).
        const double h = 1e-3 * r;
        const double along = (eval_profile_derivatives(profiles[k], r + h).curvature -
                              eval_profile_derivatives(profiles[k], r - h).curvature) /
                             (2 * h);
        const double across = (v.curvature - v.slope / r) / r;
        third = std::max(third, 1.05 * (std::abs(along) + 2 / std::sqrt(3.0) * std::abs(across)));
      }
      bounds_[i].hessian[k] = static_cast<float>(std::min(hessian, 1e30));
      bounds_[i].third[k] = static_cast<float>(std::min(third, 1e30));
      bounds_[i].slope[k] = static_cast<float>(std::min(slope, 1e30));
    }
  }

  first_jet_ = (first << kJetBits) - 1;
  jets_.resize(((static_cast<std::size_t>(last - first) + 1) << kJetBits) + 2);
  for (std::size_t k = 0; k < 3; ++k) {
    JetValues previous{0, 0};
    for (std::size_t i = 0; i + 1 < jets_.size(); ++i) {
      // The cell before the table's start holds what is there.
      const auto far_bits = static_cast<std::uint32_t>((first_jet_ + i + 1) << (23 - kJetBits));
      const double r = std::sqrt(static_cast<double>(r2_of_bits(far_bits)));
      const ProfileValue v = eval_profile_derivatives(profiles[k], r);
      const JetValues next{std::clamp(v.slope / r, -1e30, 1e30),
                           std::clamp((v.curvature - v.slope / r) / square(r), -1e30, 1e30)};
      if (i == 0) previous = next;
      jets_[i].radial[k] = static_cast<float>(previous.radial);
      jets_[i].radial_delta[k] = static_cast<float>(next.radial - previous.radial);
      jets_[i].bend[k] = static_cast<float>(previous.bend);
      jets_[i].bend_delta[k] = static_cast<float>(next.bend - previous.bend);
      previous = next;
    }
  }
}

KernelTables Kernel::tables() const noexcept {
  static_assert(sizeof(Cell) == 8 * sizeof(float) && sizeof(JetCell) == 16 * sizeof(float));
  const auto bins = [](std::uint32_t first, std::size_t count, int shift) {
    return DistanceBins{static_cast<std::int32_t>(first), static_cast<std::int32_t>(first + count - 1),
                        shift};
  };
  return {reinterpret_cast<const float*>(cells_.data()),
          reinterpret_cast<const float*>(jets_.data()),
          bins(first_cell_, cells_.size(), 23 - kCellBits),
          bins(first_jet_, jets_.size(), 23 - kJetBits),
          singular_,
          disc_table().data(),
          static_cast<float>(kDiscCells) / kDiscReach,
          kDiscReach};
}

double Kernel::relative_error(float distance) const noexcept {
  // As a function of s = r^2 the profile falls locally like a power, at most (3 + sigma r)/2, and over a cell
  // of width h s a chord errs by at most h^2/8 of s^2 R''/R. A tenth is added for rounding of the cells'
  // ends.
  const double power = (3 + std::min(steepest_ * double{distance}, 80.0)) / 2;
  return 1.1 * square(1.0 / (1 << kCellBits)) / 8 * power * (power + 1);
}

Float4 Kernel::eval_disc(float r2, float area) const noexcept {
  if (!(r2 < disc_reach2(area))) return eval(r2);
  const float radius = std::sqrt(area / kPi);
  // R(r) r is smooth; it is taken at the distance whose inverse is the mean inverse distance.
  const float t = std::sqrt(r2) / radius * (static_cast<float>(kDiscCells) / kDiscReach);
  const auto cell = std::min(static_cast<std::size_t>(t), static_cast<std::size_t>(kDiscCells - 1));
  const float fraction = t - static_cast<float>(cell);
  const auto& table = disc_table();
  const float effective = radius / (table[cell] + fraction * (table[cell + 1] - table[cell]));
  return eval(effective * effective);
}

}  // namespace nacre
