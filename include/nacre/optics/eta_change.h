// Transmitted irradiance for other indices of refraction, from what is kept of the light's angles.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "nacre/base/math.h"

namespace nacre {

/// Indices between which any other is interpolated. F_t(eta, mu) as a function of the cosine mu is, for any
/// eta from 1 to 2, a sum of those at these six, to 0.13 % of its value for mu > 0.05; and so is the
/// transmitted irradiance E_t of any light. Close together near 1, where F_t changes fastest at grazing
/// angles.
inline constexpr std::array<float, 6> kEtaNodes{1, 1.0015f, 1.008f, 1.04f, 1.2f, 2};
inline constexpr float kLeastEta = kEtaNodes.front(), kMostEta = kEtaNodes.back();

/// By channel, for the first five nodes: ln(E_t(node) / E_t(last node)) in steps of kEtaRatioStep, rounded;
/// 0 where there is no light.
using EtaRatios = std::array<std::uint16_t, 15>;
inline constexpr double kEtaRatioStep = 6.0 / 65535;

/// `transmitted[j]` is E_t for kEtaNodes[j].
EtaRatios encode_eta_ratios(std::span<const Rgb, kEtaNodes.size()> transmitted) noexcept;

/// Weights c_j with F_t(eta, mu) = sum c_j F_t(kEtaNodes[j], mu), by least squares of relative errors.
std::array<double, kEtaNodes.size()> eta_weights(double eta) noexcept;

/// What those sums give for F_t(eta, mu) at a few cosines mu from grazing to 1.
std::vector<double> entering_shares(double eta);

/// From E_t for one index to that for another, both in [kLeastEta, kMostEta].
class EtaChange {
 public:
  EtaChange(double from, double to);
  Rgb operator()(const Rgb& irradiance, const EtaRatios& ratios) const noexcept;

 private:
  bool none_;
  std::array<double, kEtaNodes.size()> from_, to_;
};

}  // namespace nacre
