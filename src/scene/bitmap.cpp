// Reads pictures: which format, how large, how its numbers become linear light.
#include "nacre/scene/bitmap.h"

#include <array>
#include <filesystem>
#include <memory>
#include <string_view>

#include "nacre/base/file.h"
#include "scene/bitmap_exr.h"
#include "scene/picture_guard.h"

#ifndef __clang_analyzer__  // which follows paths into stb's own code
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#endif
#define STBI_NO_STDIO
#define STBI_ONLY_PNG
#define STBI_ONLY_JPEG
#define STBI_ONLY_HDR
#include <stb/stb_image.h>

namespace nacre {
namespace {

constexpr std::size_t kMaxFileBytes = std::size_t{1} << 31;

enum class Format { kPng, kJpeg, kHdr, kExr };

// What a format's compression can make of one byte at most, in pixels: a header that promises more lies.
// PNG: deflate's 1032 bytes of eight pixels each; JPEG: a bit for a block of 8 x 8, and end-of-band runs;
// HDR: a run of 127 for each of four channels.
std::int64_t pixels_per_byte(Format format) {
  switch (format) {
    case Format::kPng:
      return std::int64_t{8} * 1032;
    case Format::kJpeg:
      return 2048;
    default:
      return 16;
  }
}

Format find_format(const std::string& bytes, const std::string& path) {
  using namespace std::string_view_literals;
  const std::string_view head(bytes);
  if (head.starts_with("\x89PNG"sv)) return Format::kPng;
  if (head.starts_with("\xff\xd8\xff"sv)) return Format::kJpeg;
  if (head.starts_with("#?RADIANCE"sv) || head.starts_with("#?RGBE"sv)) return Format::kHdr;
  if (head.starts_with("\x76\x2f\x31\x01"sv)) return Format::kExr;
  fail(ErrorCode::kUnsupported, path, "not a picture that nacre reads: there is PNG, JPEG, HDR, EXR");
}

// Source: IEC 61966-2-1.
float decode_srgb(float x) { return x <= 0.04045f ? x / 12.92f : std::pow((x + 0.055f) / 1.055f, 2.4f); }
float decode(float x, float gamma) {
  if (gamma == kGammaSrgb) return decode_srgb(x);
  return gamma == 1 || x <= 0 ? x : std::pow(x, gamma);
}

// The picture as three values per texel, from stb's memory, in which all its formats look alike.
template <class Value, class ToLinear>
std::vector<Rgb> take_texels(Value* values, std::size_t count, const std::string& path,
                             const ToLinear& to_linear) {
  const std::unique_ptr<Value, decltype(&stbi_image_free)> owner(values, &stbi_image_free);
  if (!values)
    fail(ErrorCode::kSyntax, path, "truncated or damaged picture: {}",
         stbi_failure_reason() ? stbi_failure_reason() : "unknown reason");
  std::vector<Rgb> texels(count);
  for (std::size_t i = 0; i < count; ++i)
    for (int k = 0; k < 3; ++k) texels[i][k] = to_linear(values[3 * i + static_cast<std::size_t>(k)]);
  return texels;
}

Bitmap decode_with_stb(const std::string& bytes, Format format, float gamma, const std::string& path) {
  const auto* data = reinterpret_cast<const stbi_uc*>(bytes.data());
  const int size = static_cast<int>(bytes.size());
  if (format == Format::kPng) check_png_chunks(bytes, path);
  if (format == Format::kJpeg) check_jpeg_tables(bytes, path);
  Bitmap bitmap;
  int channels = 0;
  if (!stbi_info_from_memory(data, size, &bitmap.width, &bitmap.height, &channels) || bitmap.width <= 0 ||
      bitmap.height <= 0)
    fail(ErrorCode::kSyntax, path, "damaged picture: {}",
         stbi_failure_reason() ? stbi_failure_reason() : "unknown reason");
  const std::int64_t pixels = std::int64_t{bitmap.width} * bitmap.height;
  if (pixels > kMaxBitmapPixels)
    fail(ErrorCode::kLimit, path, "{} x {} pixels are more than the {} that nacre reads", bitmap.width,
         bitmap.height, kMaxBitmapPixels);
  if (pixels > pixels_per_byte(format) * static_cast<std::int64_t>(bytes.size()))
    fail(ErrorCode::kSyntax, path, "truncated or damaged: {} bytes cannot hold {} x {} pixels", bytes.size(),
         bitmap.width, bitmap.height);

  int width = 0, height = 0;
  const auto count = static_cast<std::size_t>(pixels);
  if (format == Format::kHdr) {
    check_hdr_pixels(bytes, bitmap.width, bitmap.height, path);
    bitmap.texels =
        take_texels(stbi_loadf_from_memory(data, size, &width, &height, &channels, 3), count, path,
                    [&](float x) { return decode(x, gamma == kGammaOfFormat ? 1 : gamma); });
    return bitmap;
  }
  if (gamma == kGammaOfFormat) gamma = kGammaSrgb;
  if (stbi_is_16_bit_from_memory(data, size)) {
    bitmap.texels =
        take_texels(stbi_load_16_from_memory(data, size, &width, &height, &channels, 3), count, path,
                    [&](stbi_us x) { return decode(static_cast<float>(x) / 65535, gamma); });
    return bitmap;
  }
  std::array<float, 256> table;
  for (std::size_t i = 0; i < table.size(); ++i) table[i] = decode(static_cast<float>(i) / 255, gamma);
  bitmap.eight_bit = true;
  bitmap.texels = take_texels(stbi_load_from_memory(data, size, &width, &height, &channels, 3), count, path,
                              [&](stbi_uc x) { return table[x]; });
  return bitmap;
}

void check_texels(const Bitmap& bitmap, const std::string& path) {
  for (std::size_t i = 0; i < bitmap.texels.size(); ++i)
    if (!is_finite(bitmap.texels[i]))
      fail(ErrorCode::kValue, path, "pixel ({}, {}) is NaN or infinite",
           i % static_cast<std::size_t>(bitmap.width), i / static_cast<std::size_t>(bitmap.width));
}

Bitmap decode_picture(const std::string& path, float gamma) {
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored) && !std::filesystem::is_regular_file(path, ignored))
    fail(ErrorCode::kIo, path, "cannot read: not a file");
  const std::string bytes = read_text_file(path, kMaxFileBytes - 1);
  const Format format = find_format(bytes, path);
  Bitmap bitmap;
  if (format == Format::kExr) {
    bitmap = decode_exr(bytes, path);
    for (Rgb& texel : bitmap.texels)
      for (int k = 0; k < 3; ++k) texel[k] = decode(texel[k], gamma == kGammaOfFormat ? 1 : gamma);
  } else {
    bitmap = decode_with_stb(bytes, format, gamma, path);
  }
  check_texels(bitmap, path);
  return bitmap;
}

}  // namespace

Bitmap load_bitmap(const std::string& path, const std::string& place, float gamma) {
  try {
    return decode_picture(path, gamma);
  } catch (const Error& error) {
    throw Error(error.code(), place, error.what());
  } catch (const std::bad_alloc&) {
    fail(ErrorCode::kLimit, place, "{}: the picture does not fit into memory", path);
  }
}

}  // namespace nacre
