// label: unit
// Where textures show which colour.
#include "nacre/scene/texture.h"

#include <gtest/gtest.h>

#include <limits>

namespace nacre {
namespace {

// Rows 0.1 0.2 0.3 above 0.4 0.5 0.6.
Texture six_texels(WrapMode wrap, bool nearest) {
  BitmapTexture texture;
  texture.bitmap = {3, 2, {}};
  for (int i = 1; i <= 6; ++i) texture.bitmap.texels.emplace_back(0.1f * static_cast<float>(i));
  texture.wrap_u = texture.wrap_v = wrap;
  texture.nearest = nearest;
  return {"", "", texture};
}
float at(const Texture& texture, float u, float v) { return eval_texture(texture, {u, v}).x; }

TEST(Bitmaps, StandUpright) {
  for (const bool nearest : {false, true}) {
    const Texture texture = six_texels(WrapMode::kRepeat, nearest);
    for (int x = 0; x < 3; ++x) {
      const float u = (static_cast<float>(x) + 0.5f) / 3;
      EXPECT_NEAR(at(texture, u, 0.75f), 0.1 * (x + 1), 1e-6);
      EXPECT_NEAR(at(texture, u, 0.25f), 0.1 * (x + 4), 1e-6);
    }
  }
}

TEST(Bitmaps, InterpolateBetweenCentres) {
  const Texture texture = six_texels(WrapMode::kClamp, false);
  EXPECT_NEAR(at(texture, 1 / 3.0f, 0.75f), 0.15, 1e-6);
  EXPECT_NEAR(at(texture, 0.5f, 0.5f), 0.35, 1e-6);
  EXPECT_NEAR(at(texture, 1 / 3.0f, 0.5f), 0.3, 1e-6);
  EXPECT_NEAR(at(six_texels(WrapMode::kClamp, true), 0.34f, 0.51f), 0.2, 1e-6);
}

TEST(Bitmaps, WrapAsAsked) {
  const float u = 1 / 6.0f, v = 0.75f;  // centre of the first texel
  EXPECT_NEAR(at(six_texels(WrapMode::kRepeat, false), u - 3, v + 2), 0.1, 1e-5);
  EXPECT_NEAR(at(six_texels(WrapMode::kClamp, false), -7, v), 0.1, 1e-6);
  EXPECT_NEAR(at(six_texels(WrapMode::kClamp, false), 7, -7), 0.6, 1e-6);
  EXPECT_NEAR(at(six_texels(WrapMode::kMirror, false), -u, v), 0.1, 1e-6);
  EXPECT_NEAR(at(six_texels(WrapMode::kMirror, false), 2 - u, 2 - v), 0.1, 1e-5);
  EXPECT_NEAR(at(six_texels(WrapMode::kMirror, false), 1 + u, v), 0.3, 1e-6);
  // Across the seam: half of the first and the last texel, or the edge itself.
  EXPECT_NEAR(at(six_texels(WrapMode::kRepeat, false), 0, v), 0.2, 1e-6);
  EXPECT_NEAR(at(six_texels(WrapMode::kMirror, false), 0, v), 0.1, 1e-6);
  EXPECT_NEAR(at(six_texels(WrapMode::kRepeat, false), u, 0), 0.25, 1e-6);
}

TEST(Textures, ScaleAndOffsetCoordinates) {
  Texture texture = six_texels(WrapMode::kRepeat, true);
  texture.scale = {2, 1};
  texture.offset = {0.5f, 0.5f};
  EXPECT_NEAR(at(texture, 0.3f, 0.1f), 0.1, 1e-6);  // at (1.1, 0.6)
}

TEST(Checkerboards, HaveFourSquaresToAUnit) {
  const Texture board{"", "", CheckerboardTexture{Rgb(0.4f), Rgb(0.2f)}};
  EXPECT_EQ(at(board, 0.1f, 0.1f), 0.4f);
  EXPECT_EQ(at(board, 0.6f, 0.1f), 0.2f);
  EXPECT_EQ(at(board, 0.1f, 0.6f), 0.2f);
  EXPECT_EQ(at(board, 0.6f, 0.6f), 0.4f);
  EXPECT_EQ(at(board, -0.1f, 0.1f), 0.2f);
  EXPECT_EQ(at(board, 5.1f, -3.9f), 0.4f);
}

TEST(Textures, AnyCoordinateHasAColour) {
  constexpr float kInf = std::numeric_limits<float>::infinity(),
                  kNan = std::numeric_limits<float>::quiet_NaN();
  for (const WrapMode wrap : {WrapMode::kRepeat, WrapMode::kMirror, WrapMode::kClamp})
    for (const bool nearest : {false, true})
      for (const float u : {kInf, -kInf, kNan, 3e38f, -3e38f, -1e-30f, 1.0f, 2.0f, 0.99999994f})
        for (const float v : {0.5f, u}) {
          const float value = at(six_texels(wrap, nearest), u, v);
          EXPECT_TRUE(value >= 0.1f - 1e-6f && value <= 0.6f + 1e-6f) << u << ' ' << v;
        }
}

}  // namespace
}  // namespace nacre
