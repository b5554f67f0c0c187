// Looking textures up.
#include "nacre/scene/texture.h"

#include <cmath>

namespace nacre {
namespace {

// Any coordinate brought into [0, 1].
float wrap(float x, WrapMode mode) {
  if (!std::isfinite(x)) return 0;
  if (mode == WrapMode::kClamp) return std::clamp(x, 0.0f, 1.0f);
  if (mode == WrapMode::kRepeat) return x - std::floor(x);
  const float twice = x - 2 * std::floor(x / 2);  // in [0, 2]
  return twice <= 1 ? twice : 2 - twice;
}

// A texel beside the picture is the one at its other end, or the edge's again.
int wrap_texel(int i, int count, WrapMode mode) {
  if (mode == WrapMode::kRepeat) return (i + count) % count;
  return std::clamp(i, 0, count - 1);
}

Rgb eval(const BitmapTexture& texture, const Vec2& uv) {
  const Bitmap& bitmap = texture.bitmap;
  // From the left and from the top, in texels.
  const float x = wrap(uv.x, texture.wrap_u) * static_cast<float>(bitmap.width);
  const float y = (1 - wrap(uv.y, texture.wrap_v)) * static_cast<float>(bitmap.height);
  const auto texel = [&](int i, int j) {
    return bitmap.at(wrap_texel(i, bitmap.width, texture.wrap_u),
                     wrap_texel(j, bitmap.height, texture.wrap_v));
  };
  if (texture.nearest)
    return bitmap.at(std::min(static_cast<int>(x), bitmap.width - 1),
                     std::min(static_cast<int>(y), bitmap.height - 1));
  const float left = std::floor(x - 0.5f), top = std::floor(y - 0.5f);
  const float s = x - 0.5f - left, t = y - 0.5f - top;
  const int i = static_cast<int>(left), j = static_cast<int>(top);
  return (texel(i, j) * (1 - s) + texel(i + 1, j) * s) * (1 - t) +
         (texel(i, j + 1) * (1 - s) + texel(i + 1, j + 1) * s) * t;
}

Rgb eval(const CheckerboardTexture& texture, const Vec2& uv) {
  const bool right = wrap(uv.x, WrapMode::kRepeat) >= 0.5f, upper = wrap(uv.y, WrapMode::kRepeat) >= 0.5f;
  return right == upper ? texture.color0 : texture.color1;
}

}  // namespace

Rgb eval_texture(const Texture& texture, const Vec2& uv) noexcept {
  const Vec2 at = uv * texture.scale + texture.offset;
  return std::visit([&](const auto& model) { return eval(model, at); }, texture.model);
}

}  // namespace nacre
