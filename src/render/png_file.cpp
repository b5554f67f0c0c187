// PNG previews: exposure, the sRGB curve, eight bits.
#include <zlib.h>

#include <cstdint>
#include <cstdlib>
#include <memory>

#include "nacre/base/file.h"
#include "nacre/base/parallel.h"
#include "nacre/render/image_file.h"
#include "render/image_check.h"

namespace {

// zlib for stb: several times as fast as its own at the same size.
unsigned char* deflate_for_stb(unsigned char* data, int bytes, int* compressed_bytes, int /*quality*/) {
  constexpr int kLevel = 4;
  uLongf size = compressBound(static_cast<uLong>(bytes));
  auto* const compressed = static_cast<unsigned char*>(std::malloc(size));
  if (!compressed) return nullptr;
  if (compress2(compressed, &size, data, static_cast<uLong>(bytes), kLevel) != Z_OK) {
    std::free(compressed);
    return nullptr;
  }
  *compressed_bytes = static_cast<int>(size);
  return compressed;
}

}  // namespace

#define STBIW_ZLIB_COMPRESS deflate_for_stb
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#define STBI_WRITE_NO_STDIO
#include <stb/stb_image_write.h>

namespace nacre {
namespace {

// stb counts bytes, and the room that it keeps for them, in an int.
constexpr std::int64_t kMaxPngBytes = 900'000'000;

using Planes = std::array<const std::vector<float>*, 3>;

Planes find_rgb(const Image& image, const std::string& path) {
  Planes planes{};
  for (std::size_t c = 0; c < 3; ++c) {
    const std::string name(1, "RGB"[c]);
    const Channel* channel = find_channel(image, name);
    if (!channel)
      fail(ErrorCode::kValue, path, "a picture needs R, G and B, and channel {} is missing", name);
    planes[c] = &channel->values;
  }
  return planes;
}

// Source: IEC 61966-2-1.
std::uint8_t encode_srgb(double linear) {
  const double x = std::clamp(linear, 0.0, 1.0);
  const double encoded = x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::lround(255 * encoded));
}

}  // namespace

Preview make_preview(const Image& image, const std::string& path, double exposure) {
  check_image(image, path);
  const Planes planes = find_rgb(image, path);
  const double scale = std::exp2(exposure);
  if (!std::isfinite(scale))
    fail(ErrorCode::kValue, path, "an exposure of {} EV is outside what nacre can scale by", exposure);
  const std::size_t pixels = planes[0]->size();
  Preview preview{image.width, image.height, std::vector<std::uint8_t>(3 * pixels)};
  parallel_for(pixels, 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      for (std::size_t c = 0; c < 3; ++c)
        preview.rgb[3 * i + c] = encode_srgb(double{(*planes[c])[i]} * scale);
  });
  return preview;
}

std::vector<std::uint8_t> encode_png(const Preview& preview, const std::string& path) {
  if ((3 * std::int64_t{preview.width} + 1) * preview.height > kMaxPngBytes)
    fail(ErrorCode::kLimit, path, "{} x {} pixels are too many for a PNG; write OpenEXR alone", preview.width,
         preview.height);
  int length = 0;
  const std::unique_ptr<unsigned char, decltype(&std::free)> png(
      stbi_write_png_to_mem(preview.rgb.data(), 3 * preview.width, preview.width, preview.height, 3, &length),
      &std::free);
  if (!png) fail(ErrorCode::kLimit, path, "the PNG does not fit into memory");
  return {png.get(), png.get() + length};
}

void save_png(const Image& image, const std::string& path, double exposure) {
  const std::vector<std::uint8_t> png = encode_png(make_preview(image, path, exposure), path);
  AtomicFile file(path);
  file.write(png.data(), png.size());
  file.commit();
}

double auto_exposure(const Image& image) {
  const Planes planes = find_rgb(image, "--exposure auto");
  const Channel* alpha = find_channel(image, "A");
  std::vector<float> brightest;
  for (std::size_t i = 0; i < planes[0]->size(); ++i) {
    const float v = std::max({(*planes[0])[i], (*planes[1])[i], (*planes[2])[i]});
    if ((!alpha || alpha->values[i] > 0) && std::isfinite(v)) brightest.push_back(v);
  }
  if (brightest.empty()) return 0;
  const auto at =
      brightest.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(brightest.size() - 1));
  std::ranges::nth_element(brightest, at);
  return *at > 0 ? std::log2(0.8 / static_cast<double>(*at)) : 0;
}

}  // namespace nacre
