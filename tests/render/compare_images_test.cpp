// label: unit
// Differences between images, against values worked out by hand.
#include <gtest/gtest.h>

#include <limits>

#include "nacre/render/image_file.h"

namespace nacre {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

Image make_image(int width, int height, const std::vector<std::string>& names) {
  Image image{width, height, 0, 0, width, height, {}, {}};
  for (const std::string& name : names)
    image.channels.push_back({name, std::vector<float>(static_cast<std::size_t>(width * height), 0.5f)});
  return image;
}

// The reason for which `layer` of a and b cannot be compared; fails the test if it can.
std::string refusal(const Image& a, const Image& b, const std::string& layer) {
  try {
    compare_images(a, b, layer);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kMismatch);
    return error.reason();
  }
  ADD_FAILURE() << "they were compared";
  return "";
}

TEST(CompareImages, IdenticalImages) {
  const Image image = make_image(5, 5, {"R", "G", "B", "A", "diffusion.R"});
  for (const std::string& layer : layer_names(image)) {
    const ImageDifference d = compare_images(image, image, layer);
    EXPECT_TRUE(d.identical);
    EXPECT_EQ(d.relative_rmse, 0);
    EXPECT_EQ(d.largest_relative, 0);
    EXPECT_EQ(d.psnr, kInf);
  }
}

TEST(CompareImages, KnownDifferences) {
  Image b = make_image(2, 2, {"x.R", "x.G", "R"});
  b.channels[0].values = {3, 4, 0, 0};
  b.channels[1].values = {1, 1, 1, 1};
  b.x = 10;
  b.y = 20;
  b.full_width = b.full_height = 100;
  Image a = b;
  a.channels[0].values = {3, 4.5f, 0.1f, 0};  // where b is 0 there is no relative error
  a.channels[1].values = {1, 1, 1, 1.25f};
  a.channels[2].values = {9, 9, 9, 9};  // another layer
  const ImageDifference d = compare_images(a, b, "x");
  EXPECT_FALSE(d.identical);
  EXPECT_NEAR(d.relative_rmse, std::sqrt(0.0625 / 4), 1e-7);  // G; R has sqrt(0.26 / 25) = 0.102
  EXPECT_NEAR(d.largest_relative, 0.25, 1e-7);
  EXPECT_EQ(d.largest_channel, "x.G");
  EXPECT_EQ(d.largest_x, 11);
  EXPECT_EQ(d.largest_y, 21);
  EXPECT_NEAR(d.psnr, 10 * std::log10(1 / (0.0625 / 4)), 1e-5);
  EXPECT_FALSE(compare_images(a, b, "").identical);
}

TEST(CompareImages, DarkPixelsHaveNoRelativeError) {
  Image b = make_image(3, 1, {"R"});
  b.channels[0].values = {1, 0.9e-4f, 1.1e-4f};
  Image a = b;
  a.channels[0].values = {1, 1.8e-4f, 1.1e-4f};
  EXPECT_EQ(compare_images(a, b, "").largest_relative, 0);
  a.channels[0].values = {1, 0.9e-4f, 2.2e-4f};
  EXPECT_NEAR(compare_images(a, b, "").largest_relative, 1, 1e-6);
}

TEST(CompareImages, WhatIsNoNumberIsAsWrongAsCanBe) {
  Image b = make_image(3, 1, {"R"});
  Image a = b;
  for (const float bad : {kNan, kInf}) {
    a.channels[0].values[1] = bad;
    for (const ImageDifference& d : {compare_images(a, b, ""), compare_images(b, a, "")}) {
      EXPECT_FALSE(d.identical);
      EXPECT_EQ(d.relative_rmse, kInf);
      EXPECT_EQ(d.largest_relative, kInf);
      EXPECT_EQ(d.largest_x, 1);
      EXPECT_EQ(d.psnr, -kInf);
    }
    EXPECT_TRUE(compare_images(a, a, "").identical);
    EXPECT_EQ(compare_images(a, a, "").relative_rmse, 0);
  }
}

TEST(CompareImages, BlackAgainstBlackAndAgainstLight) {
  Image black = make_image(2, 1, {"R"});
  black.channels[0].values = {0, 0};
  Image negative_zero = black;
  negative_zero.channels[0].values = {-0.0f, 0};
  EXPECT_EQ(compare_images(negative_zero, black, "").relative_rmse, 0);
  EXPECT_FALSE(compare_images(negative_zero, black, "").identical);
  Image light = black;
  light.channels[0].values = {1, 0};
  EXPECT_EQ(compare_images(light, black, "").relative_rmse, kInf);
}

TEST(CompareImages, RefusesWhatCannotBeCompared) {
  const Image image = make_image(4, 4, {"R", "G", "B"});
  EXPECT_NE(refusal(image, make_image(4, 5, {"R", "G", "B"}), "").find("4 x 5"), std::string::npos);
  EXPECT_NE(refusal(image, make_image(4, 4, {"R", "G"}), "").find("channel B"), std::string::npos);
  EXPECT_NE(refusal(make_image(4, 4, {"R", "G"}), image, "").find("channel B"), std::string::npos);
  EXPECT_NE(refusal(image, image, "diffusion").find("'diffusion'"), std::string::npos);
}

TEST(LayerNames, BeautyFirst) {
  const Image image = make_image(1, 1, {"diffusion.R", "diffusion.G", "R", "G", "B", "depth.Z", "object.id"});
  EXPECT_EQ(layer_names(image), (std::vector<std::string>{"", "diffusion", "depth", "object"}));
  EXPECT_EQ(layer_names(make_image(1, 1, {"x.R"})), std::vector<std::string>{"x"});
}

}  // namespace
}  // namespace nacre
