// Least squares over angles, and ratios as logarithms.
#include "nacre/optics/eta_change.h"

#include <algorithm>
#include <cmath>

#include "nacre/optics/fresnel.h"

namespace nacre {
namespace {

constexpr std::size_t kNodes = kEtaNodes.size(), kRatios = kNodes - 1;

// Cosines at which functions are compared, denser where F_t is steep.
constexpr std::size_t kAngles = 256;
double angle_cosine(std::size_t i) { return 0.02 * std::pow(50.0, (static_cast<double>(i) + 0.5) / kAngles); }

double transmittance(double eta, double cosine) { return 1 - fresnel_reflectance(cosine, eta); }

// exp(kEtaRatioStep * code) as a product of two, since there is one for each sample, channel and node.
struct Exponentials {
  std::array<double, 256> high, low;
  Exponentials() {
    for (std::size_t i = 0; i < 256; ++i) {
      high[i] = std::exp(kEtaRatioStep * 256 * static_cast<double>(i));
      low[i] = std::exp(kEtaRatioStep * static_cast<double>(i));
    }
  }
};

}  // namespace

EtaRatios encode_eta_ratios(std::span<const Rgb, kNodes> transmitted) noexcept {
  EtaRatios ratios{};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto channel = static_cast<int>(k);
    const double last = transmitted[kRatios][channel];
    if (!(last > 0)) continue;
    for (std::size_t j = 0; j < kRatios; ++j) {
      const double code = std::log(double{transmitted[j][channel]} / last) / kEtaRatioStep;
      ratios[kRatios * k + j] = static_cast<std::uint16_t>(std::clamp(code + 0.5, 0.0, 65535.0));
    }
  }
  return ratios;
}

// By the modified Gram-Schmidt process: neighbouring nodes are nearly parallel, normal equations would lose
// half of the digits.
std::array<double, kNodes> eta_weights(double eta) noexcept {
  std::array<std::array<double, kAngles>, kNodes> columns;
  std::array<double, kAngles> rest;
  for (std::size_t i = 0; i < kAngles; ++i) {
    const double cosine = angle_cosine(i), scale = 1 / transmittance(eta, cosine);
    rest[i] = 1;
    for (std::size_t j = 0; j < kNodes; ++j)
      columns[j][i] = scale * transmittance(double{kEtaNodes[j]}, cosine);
  }
  const auto dot = [](const auto& a, const auto& b) {
    double sum = 0;
    for (std::size_t i = 0; i < kAngles; ++i) sum += a[i] * b[i];
    return sum;
  };
  std::array<std::array<double, kNodes>, kNodes> r{};
  std::array<double, kNodes> weights{};
  for (std::size_t j = 0; j < kNodes; ++j) {
    r[j][j] = std::sqrt(dot(columns[j], columns[j]));
    for (double& x : columns[j]) x /= r[j][j];
    for (std::size_t k = j + 1; k < kNodes; ++k) {
      r[j][k] = dot(columns[j], columns[k]);
      for (std::size_t i = 0; i < kAngles; ++i) columns[k][i] -= r[j][k] * columns[j][i];
    }
    weights[j] = dot(columns[j], rest);
    for (std::size_t i = 0; i < kAngles; ++i) rest[i] -= weights[j] * columns[j][i];
  }
  for (std::size_t j = kNodes; j-- > 0;) {
    for (std::size_t k = j + 1; k < kNodes; ++k) weights[j] -= r[j][k] * weights[k];
    weights[j] /= r[j][j];
  }
  return weights;
}

std::vector<double> entering_shares(double eta) {
  const auto weights = eta_weights(eta);
  std::vector<double> shares;
  for (const double cosine : {0.1, 0.2, 0.35, 0.6, 1.0}) {
    shares.push_back(0);
    for (std::size_t j = 0; j < kNodes; ++j)
      shares.back() += weights[j] * transmittance(double{kEtaNodes[j]}, cosine);
  }
  return shares;
}

EtaChange::EtaChange(double from, double to)
    : none_(from == to), from_(eta_weights(from)), to_(eta_weights(to)) {}

Rgb EtaChange::operator()(const Rgb& irradiance, const EtaRatios& ratios) const noexcept {
  if (none_) return irradiance;
  static const Exponentials exponentials;
  Rgb changed;
  for (std::size_t k = 0; k < 3; ++k) {
    double before = from_[kRatios], after = to_[kRatios];
    for (std::size_t j = 0; j < kRatios; ++j) {
      const std::uint16_t code = ratios[kRatios * k + j];
      const double ratio = exponentials.high[code >> 8] * exponentials.low[code & 255];
      before += from_[j] * ratio;
      after += to_[j] * ratio;
    }
    // Both are irradiances over one; a file may hold anything.
    const double factor = before > 0 && after > 0 ? std::min(after / before, 1e3) : 1;
    changed[static_cast<int>(k)] = static_cast<float>(irradiance[static_cast<int>(k)] * factor);
  }
  return changed;
}

}  // namespace nacre
