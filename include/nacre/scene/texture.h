// Colours that vary over a surface: pictures and patterns over its texture coordinates.
#pragma once

#include <string>
#include <variant>

#include "nacre/scene/bitmap.h"

namespace nacre {

enum class WrapMode { kRepeat, kMirror, kClamp };

/// A picture on [0,1]^2: u grows to its right, v upwards from its bottom.
struct BitmapTexture {
  Bitmap bitmap;  // at least one texel; of a reflectance, all within [0, 1]
  WrapMode wrap_u = WrapMode::kRepeat, wrap_v = WrapMode::kRepeat;
  bool nearest = false;  // else bilinear
};

/// Four squares to a unit of u and v: color0 where both have the same parity, as at (0, 0).
struct CheckerboardTexture {
  Rgb color0{0.4f, 0.4f, 0.4f}, color1{0.2f, 0.2f, 0.2f};
};

struct Texture {
  std::string id, place;
  std::variant<BitmapTexture, CheckerboardTexture> model;
  Vec2 scale{1, 1}, offset{0, 0};  // looked up at uv * scale + offset
};

/// Colour at any texture coordinates, finite or not.
Rgb eval_texture(const Texture& texture, const Vec2& uv) noexcept;

}  // namespace nacre
