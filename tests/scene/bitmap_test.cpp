// label: unit
// Pictures are read as linear light, and broken ones are refused.
#include "nacre/scene/bitmap.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "nacre/base/file.h"
#include "nacre/render/image_file.h"

#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#include <stb/stb_image_write.h>

namespace nacre {
namespace {

class BitmapTest : public testing::Test {
 protected:
  BitmapTest() {
    std::string name = testing::TempDir() + "/nacre_bitmap_XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  ~BitmapTest() override { std::filesystem::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string write(const std::string& name, const std::string& bytes) const {
    std::ofstream(path(name), std::ios::binary) << bytes;
    return path(name);
  }
  static Error error_of(const std::string& file) {
    try {
      load_bitmap(file, "scene.xml:7");
    } catch (const Error& error) {
      return error;
    }
    ADD_FAILURE() << file << " was accepted";
    return {ErrorCode::kIo, "", ""};
  }
  // 3 x 2 with R, G, B or only Y.
  std::string save(const std::string& name, const std::vector<std::string>& channels) const {
    Image image;
    image.full_width = image.width = 3;
    image.full_height = image.height = 2;
    for (std::size_t k = 0; k < channels.size(); ++k) {
      image.channels.push_back({channels[k], {}});
      for (int i = 0; i < 6; ++i)
        image.channels.back().values.push_back(static_cast<float>(i) + 0.25f * static_cast<float>(k));
    }
    save_exr(image, path(name));
    return path(name);
  }

 private:
  std::filesystem::path folder_;
};

const unsigned char kPixels[] = {255, 0, 0, 128, 128, 128, 0, 0, 255, 10, 20, 30, 255, 255, 255, 0, 0, 0};

TEST_F(BitmapTest, PngIsSrgbUnlessToldOtherwise) {
  stbi_write_png(path("a.png").c_str(), 3, 2, 3, kPixels, 9);
  const Bitmap bitmap = load_bitmap(path("a.png"), "");
  ASSERT_EQ(bitmap.width, 3);
  ASSERT_EQ(bitmap.height, 2);
  EXPECT_TRUE(bitmap.eight_bit);
  EXPECT_EQ(bitmap.at(0, 0), Rgb(1, 0, 0));
  EXPECT_EQ(bitmap.at(2, 0), Rgb(0, 0, 1));
  EXPECT_NEAR(bitmap.at(1, 0).y, 0.2158605f, 1e-6);
  EXPECT_NEAR(bitmap.at(0, 1).x, 10 / 255.0 / 12.92, 1e-7);
  EXPECT_NEAR(load_bitmap(path("a.png"), "", 1).at(0, 1).z, 30 / 255.0, 1e-7);
  EXPECT_NEAR(load_bitmap(path("a.png"), "", 2).at(1, 0).x, square(128 / 255.0), 1e-6);
}

TEST_F(BitmapTest, AlphaIsLeftOutAndGreyIsSpread) {
  const unsigned char rgba[] = {255, 0, 255, 0}, grey[] = {255};
  stbi_write_png(path("a.png").c_str(), 1, 1, 4, rgba, 4);
  stbi_write_png(path("g.png").c_str(), 1, 1, 1, grey, 1);
  EXPECT_EQ(load_bitmap(path("a.png"), "").at(0, 0), Rgb(1, 0, 1));
  EXPECT_EQ(load_bitmap(path("g.png"), "").at(0, 0), Rgb(1, 1, 1));
}

TEST_F(BitmapTest, Jpeg) {
  std::vector<unsigned char> grey(3 * 16 * 16, 128);
  stbi_write_jpg(path("a.jpg").c_str(), 16, 16, 3, grey.data(), 95);
  const Bitmap bitmap = load_bitmap(path("a.jpg"), "");
  EXPECT_EQ(bitmap.width, 16);
  EXPECT_NEAR(bitmap.at(7, 9).y, 0.2158605f, 5e-3);
}

TEST_F(BitmapTest, FloatingPointFormatsAreLinear) {
  const float values[] = {1, 2, 4, 1000, 0.5f, 0.25f};
  stbi_write_hdr(path("a.hdr").c_str(), 1, 2, 3, values);
  const Bitmap hdr = load_bitmap(path("a.hdr"), "");
  EXPECT_FALSE(hdr.eight_bit);
  EXPECT_EQ(hdr.at(0, 0), Rgb(1, 2, 4));
  EXPECT_NEAR(hdr.at(0, 1).x, 1000, 4);

  const Bitmap exr = load_bitmap(save("a.exr", {"R", "G", "B"}), "");
  ASSERT_EQ(exr.width, 3);
  ASSERT_EQ(exr.height, 2);
  EXPECT_EQ(exr.at(2, 1), Rgb(5, 5.25f, 5.5f));
  EXPECT_EQ(load_bitmap(save("y.exr", {"Y"}), "").at(1, 0), Rgb(1, 1, 1));
}

// Higher than the block of lines that is decoded at once.
TEST_F(BitmapTest, TallExr) {
  Image image;
  image.full_width = image.width = 5;
  image.full_height = image.height = 101;
  for (const char* name : {"B", "G", "R"}) image.channels.push_back({name, std::vector<float>(505)});
  for (std::size_t i = 0; i < 505; ++i) image.channels[2].values[i] = static_cast<float>(i);
  save_exr(image, path("t.exr"));
  const Bitmap bitmap = load_bitmap(path("t.exr"), "");
  ASSERT_EQ(bitmap.texels.size(), 505u);
  for (int y = 0; y < 101; ++y)
    for (int x = 0; x < 5; ++x) EXPECT_EQ(bitmap.at(x, y), Rgb(static_cast<float>(5 * y + x), 0, 0));
}

TEST_F(BitmapTest, RefusalsNameTheFileAndThePlace) {
  const Error missing = error_of(path("none.png"));
  EXPECT_EQ(missing.code(), ErrorCode::kNotFound);
  EXPECT_EQ(missing.place(), "scene.xml:7");
  EXPECT_NE(missing.reason().find("none.png"), std::string::npos);
  EXPECT_EQ(error_of(write("a.gif", "GIF89a")).code(), ErrorCode::kUnsupported);
  EXPECT_EQ(error_of(write("empty.png", "")).code(), ErrorCode::kUnsupported);
  EXPECT_EQ(error_of(std::filesystem::path(path("x")).parent_path().string()).code(), ErrorCode::kIo);
  EXPECT_EQ(error_of(save("d.exr", {"depth.Z"})).code(), ErrorCode::kUnsupported);
}

TEST_F(BitmapTest, CutAndBrokenFilesAreRefused) {
  stbi_write_png(path("a.png").c_str(), 3, 2, 3, kPixels, 9);
  const float values[] = {1, 2, 4, 1000, 0.5f, 0.25f};
  stbi_write_hdr(path("a.hdr").c_str(), 1, 2, 3, values);
  save("a.exr", {"R", "G", "B"});
  for (const char* name : {"a.png", "a.exr"}) {
    const std::string bytes = read_text_file(path(name));
    for (const std::size_t kept : {std::size_t{12}, bytes.size() / 2, bytes.size() - 9}) {
      const Error error = error_of(write(std::string("cut_") + name, bytes.substr(0, kept)));
      EXPECT_EQ(error.code(), ErrorCode::kSyntax) << name << " " << kept << ": " << error.what();
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
  // Bits that flip may go unseen in formats without checksums, but never crash.
  for (const char* name : {"a.png", "a.hdr", "a.exr"}) {
    const std::string bytes = read_text_file(path(name));
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      std::string broken = bytes;
      broken[i] = static_cast<char>(broken[i] ^ 0xff);
      try {
        const Bitmap bitmap = load_bitmap(write(std::string("broken_") + name, broken), "");
        EXPECT_EQ(bitmap.texels.size(), static_cast<std::size_t>(bitmap.width * bitmap.height));
        for (const Rgb& texel : bitmap.texels) EXPECT_TRUE(is_finite(texel));
      } catch (const Error&) {
      }
    }
  }
}

// Headers that promise a great deal more than the file holds.
TEST_F(BitmapTest, HostileSizesAreRefusedBeforeMemoryIsTaken) {
  stbi_write_png(path("a.png").c_str(), 3, 2, 3, kPixels, 9);
  std::string png = read_text_file(path("a.png"));
  png.replace(16, 8, std::string("\0\0\x27\x10\0\0\x27\x10", 8));  // 10000 x 10000
  EXPECT_EQ(error_of(write("b.png", png)).code(), ErrorCode::kSyntax);
  png.replace(16, 8, std::string("\0\1\0\0\0\0\x08\x34", 8));
  EXPECT_EQ(error_of(write("c.png", png)).code(), ErrorCode::kLimit);
  const std::string hdr = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 10000 +X 10000\n";
  EXPECT_EQ(error_of(write("b.hdr", hdr)).code(), ErrorCode::kSyntax);
  EXPECT_EQ(error_of(write("c.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2000000000 +X 2\n")).code(),
            ErrorCode::kLimit);
}

TEST_F(BitmapTest, NotANumberIsRefused) {
  // save_exr refuses it, so it is put in afterwards: the one uncompressed value of a 1 x 1 picture.
  Image image;
  image.full_width = image.width = image.full_height = image.height = 1;
  for (const char* name : {"B", "G", "R"}) image.channels.push_back({name, {12345.678f}});
  save_exr(image, path("n.exr"));
  std::string bytes = read_text_file(path("n.exr"));
  const float value = 12345.678f, nan = std::nanf("");
  const std::string from(reinterpret_cast<const char*>(&value), 4),
      to(reinterpret_cast<const char*>(&nan), 4);
  const std::size_t at = bytes.rfind(from);
  ASSERT_NE(at, std::string::npos);
  bytes.replace(at, 4, to);
  const Error error = error_of(write("n.exr", bytes));
  EXPECT_EQ(error.code(), ErrorCode::kValue);
  EXPECT_NE(error.reason().find("pixel (0, 0)"), std::string::npos) << error.reason();
}

}  // namespace
}  // namespace nacre
