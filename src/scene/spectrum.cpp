// CIE 1931 integration and the sRGB curve.
#include "scene/spectrum.h"

#include <algorithm>
#include <array>
#include <iterator>

namespace nacre {
namespace {

constexpr double kFirst = 380, kLast = 780, kStep = 5;  // nm

// CIE 1931 2-degree colour matching functions x, y, z every 5 nm. Source: ISO/CIE 11664-1.
// clang-format off
constexpr std::array<std::array<double, 3>, 81> kMatching{{
    {0.001368, 0.000039, 0.006450}, {0.002236, 0.000064, 0.010550}, {0.004243, 0.000120, 0.020050},
    {0.007650, 0.000217, 0.036210}, {0.014310, 0.000396, 0.067850}, {0.023190, 0.000640, 0.110200},
    {0.043510, 0.001210, 0.207400}, {0.077630, 0.002180, 0.371300}, {0.134380, 0.004000, 0.645600},
    {0.214770, 0.007300, 1.039050}, {0.283900, 0.011600, 1.385600}, {0.328500, 0.016840, 1.622960},
    {0.348280, 0.023000, 1.747060}, {0.348060, 0.029800, 1.782600}, {0.336200, 0.038000, 1.772110},
    {0.318700, 0.048000, 1.744100}, {0.290800, 0.060000, 1.669200}, {0.251100, 0.073900, 1.528100},
    {0.195360, 0.090980, 1.287640}, {0.142100, 0.112600, 1.041900}, {0.095640, 0.139020, 0.812950},
    {0.057950, 0.169300, 0.616200}, {0.032010, 0.208020, 0.465180}, {0.014700, 0.258600, 0.353300},
    {0.004900, 0.323000, 0.272000}, {0.002400, 0.407300, 0.212300}, {0.009300, 0.503000, 0.158200},
    {0.029100, 0.608200, 0.111700}, {0.063270, 0.710000, 0.078250}, {0.109600, 0.793200, 0.057250},
    {0.165500, 0.862000, 0.042160}, {0.225750, 0.914850, 0.029840}, {0.290400, 0.954000, 0.020300},
    {0.359700, 0.980300, 0.013400}, {0.433450, 0.994950, 0.008750}, {0.512050, 1.000000, 0.005750},
    {0.594500, 0.995000, 0.003900}, {0.678400, 0.978600, 0.002750}, {0.762100, 0.952000, 0.002100},
    {0.842500, 0.915400, 0.001800}, {0.916300, 0.870000, 0.001650}, {0.978600, 0.816300, 0.001400},
    {1.026300, 0.757000, 0.001100}, {1.056700, 0.694900, 0.001000}, {1.062200, 0.631000, 0.000800},
    {1.045600, 0.566800, 0.000600}, {1.002600, 0.503000, 0.000340}, {0.938400, 0.441200, 0.000240},
    {0.854450, 0.381000, 0.000190}, {0.751400, 0.321000, 0.000100}, {0.642400, 0.265000, 0.000050},
    {0.541900, 0.217000, 0.000030}, {0.447900, 0.175000, 0.000020}, {0.360800, 0.138200, 0.000010},
    {0.283500, 0.107000, 0.000000}, {0.218700, 0.081600, 0.000000}, {0.164900, 0.061000, 0.000000},
    {0.121200, 0.044580, 0.000000}, {0.087400, 0.032000, 0.000000}, {0.063600, 0.023200, 0.000000},
    {0.046770, 0.017000, 0.000000}, {0.032900, 0.011920, 0.000000}, {0.022700, 0.008210, 0.000000},
    {0.015840, 0.005723, 0.000000}, {0.011359, 0.004102, 0.000000}, {0.008111, 0.002929, 0.000000},
    {0.005790, 0.002091, 0.000000}, {0.004109, 0.001484, 0.000000}, {0.002899, 0.001047, 0.000000},
    {0.002049, 0.000740, 0.000000}, {0.001440, 0.000520, 0.000000}, {0.001000, 0.000361, 0.000000},
    {0.000690, 0.000249, 0.000000}, {0.000476, 0.000172, 0.000000}, {0.000332, 0.000120, 0.000000},
    {0.000235, 0.000085, 0.000000}, {0.000166, 0.000060, 0.000000}, {0.000117, 0.000042, 0.000000},
    {0.000083, 0.000030, 0.000000}, {0.000059, 0.000021, 0.000000}, {0.000042, 0.000015, 0.000000},
}};
// clang-format on

// XYZ to linear sRGB. Source: IEC 61966-2-1.
constexpr double kXyzToRgb[3][3] = {{3.2404542, -1.5371385, -0.4985314},
                                    {-0.9692660, 1.8760108, 0.0415560},
                                    {0.0556434, -0.2040259, 1.0572252}};

// Response of the linear sRGB channels to light of one wavelength.
Vec3d response(double wavelength) {
  const double at = std::clamp((wavelength - kFirst) / kStep, 0.0, (kLast - kFirst) / kStep);
  const auto i = std::min(static_cast<std::size_t>(at), kMatching.size() - 2);
  const double t = at - static_cast<double>(i);
  Vec3d rgb(0, 0, 0);
  for (int channel = 0; channel < 3; ++channel)
    for (std::size_t k = 0; k < 3; ++k)
      rgb[channel] += kXyzToRgb[channel][k] * ((1 - t) * kMatching[i][k] + t * kMatching[i + 1][k]);
  return rgb;
}

double eval(const std::vector<std::pair<double, double>>& samples, double wavelength) {
  const auto after = std::ranges::lower_bound(samples, wavelength, {}, &std::pair<double, double>::first);
  if (after == samples.begin()) return samples.front().second;
  if (after == samples.end()) return samples.back().second;
  const auto before = std::prev(after);
  const double t = (wavelength - before->first) / (after->first - before->first);
  return (1 - t) * before->second + t * after->second;
}

}  // namespace

double decode_srgb(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

Rgb spectrum_to_rgb(const std::vector<std::pair<double, double>>& samples) {
  const double first_value = samples.front().second;
  if (std::ranges::all_of(samples, [&](const auto& s) { return s.second == first_value; }))
    return Rgb(static_cast<float>(first_value));

  std::vector<double> knots;
  for (std::size_t i = 0; i < kMatching.size(); ++i) knots.push_back(kFirst + kStep * static_cast<double>(i));
  for (const auto& [wavelength, value] : samples)
    if (wavelength > kFirst && wavelength < kLast) knots.push_back(wavelength);
  std::ranges::sort(knots);

  // Spectrum and responses are linear between knots, so that Simpson's rule is exact.
  Vec3d sum(0, 0, 0), white(0, 0, 0);
  for (std::size_t i = 0; i + 1 < knots.size(); ++i) {
    const double a = knots[i], b = knots[i + 1], middle = (a + b) / 2;
    const Vec3d at_a = response(a) * (b - a), at_middle = response(middle) * (4 * (b - a)),
                at_b = response(b) * (b - a);
    sum += at_a * eval(samples, a) + at_middle * eval(samples, middle) + at_b * eval(samples, b);
    white += at_a + at_middle + at_b;
  }
  const Vec3d rgb = sum / white;
  return Rgb(static_cast<float>(std::max(rgb.x, 0.0)), static_cast<float>(std::max(rgb.y, 0.0)),
             static_cast<float>(std::max(rgb.z, 0.0)));
}

}  // namespace nacre
