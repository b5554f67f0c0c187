// Spectra and display colours as scene-linear rgb.
#pragma once

#include <utility>
#include <vector>

#include "nacre/base/math.h"

namespace nacre {

/// Linear light of an sRGB-encoded channel. Source: IEC 61966-2-1.
double decode_srgb(double encoded);

/// Linear sRGB of a spectrum given as (wavelength in nm, value), wavelengths increasing, linear in between
/// and constant beyond both ends. Weighted with the CIE 1931 colour matching functions and balanced so that a
/// flat spectrum is grey: exactly (c, c, c). Colours outside sRGB are clamped at 0.
Rgb spectrum_to_rgb(const std::vector<std::pair<double, double>>& samples);

}  // namespace nacre
