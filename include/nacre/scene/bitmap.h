// Pictures that light and colour a scene: environment maps and textures.
#pragma once

#include <string>
#include <vector>

#include "nacre/base/error.h"
#include "nacre/base/math.h"

namespace nacre {

/// Scene-linear texels, rows from the top.
struct Bitmap {
  int width = 0, height = 0;
  std::vector<Rgb> texels;
  bool eight_bit = false;  // made from at most 8 bits per channel

  const Rgb& at(int x, int y) const {
    return texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
};

/// How a picture's numbers become linear light.
inline constexpr float kGammaOfFormat = 0;  // sRGB for PNG and JPEG, linear for HDR and EXR
inline constexpr float kGammaSrgb = -1;     // else value^gamma; 1 takes the numbers as they are

/// Reads PNG, JPEG (8 or 16 bits), Radiance HDR or OpenEXR, told apart by their content; alpha is left out
/// and grey becomes three equal channels. Memory stays in proportion to the file. Throws Error with `place`,
/// naming the file: kNotFound, kIo, kUnsupported (another format), kSyntax (damaged), kLimit (too large),
/// kValue (NaN or infinite texels).
Bitmap load_bitmap(const std::string& path, const std::string& place, float gamma = kGammaOfFormat);

}  // namespace nacre
