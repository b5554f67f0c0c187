// Differences between two images, layer by layer.
#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string_view>

#include "nacre/render/image_file.h"

namespace nacre {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string_view layer_of(std::string_view channel) {
  const std::size_t dot = channel.rfind('.');
  return dot == std::string_view::npos ? std::string_view() : channel.substr(0, dot);
}

std::string describe(const std::string& layer) {
  return layer.empty() ? "the beauty layer" : fmt::format("layer '{}'", layer);
}

void check_comparable(const Image& a, const Image& b, const std::string& layer) {
  if (a.full_width != b.full_width || a.full_height != b.full_height || a.x != b.x || a.y != b.y ||
      a.width != b.width || a.height != b.height)
    fail(ErrorCode::kMismatch, "",
         "the first image is {} x {} at ({}, {}) of {} x {}, the second {} x {} at ({}, {}) of {} x {}",
         a.width, a.height, a.x, a.y, a.full_width, a.full_height, b.width, b.height, b.x, b.y, b.full_width,
         b.full_height);
  const auto check_channels = [&](const Image& from, const Image& in, const char* which) {
    for (const Channel& channel : from.channels)
      if (layer_of(channel.name) == layer && !find_channel(in, channel.name))
        fail(ErrorCode::kMismatch, "", "channel {} of {} is missing in the {} image", channel.name,
             describe(layer), which);
  };
  check_channels(a, b, "second");
  check_channels(b, a, "first");
}

// A number that is none, and not the same in both, is as wrong as can be.
double difference(float a, float b) {
  const double d = std::abs(static_cast<double>(a) - static_cast<double>(b));
  if (std::isfinite(d)) return d;
  return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b) ? 0 : kInfinity;
}

// error / size where no error is no matter how small the size is.
double ratio(double error, double size) { return error == 0 ? 0 : size == 0 ? kInfinity : error / size; }

void compare_channel(const Image& frame, const Channel& a, const Channel& b, ImageDifference& result) {
  double largest = 0, sum_b = 0, sum_error = 0;
  for (const float v : b.values)
    if (std::isfinite(v)) largest = std::max(largest, std::abs(static_cast<double>(v)));
  for (std::size_t i = 0; i < b.values.size(); ++i) {
    const double error = difference(a.values[i], b.values[i]);
    const double size = std::isfinite(b.values[i]) ? std::abs(static_cast<double>(b.values[i])) : largest;
    sum_error += square(error);
    sum_b += square(size);
    const double relative = size > 1e-4 * largest || error == kInfinity ? ratio(error, size) : 0;
    if (relative > result.largest_relative) {
      result.largest_relative = relative;
      result.largest_x = frame.x + static_cast<int>(i % static_cast<std::size_t>(frame.width));
      result.largest_y = frame.y + static_cast<int>(i / static_cast<std::size_t>(frame.width));
      result.largest_channel = b.name;
    }
  }
  const double mean_square = sum_error / static_cast<double>(b.values.size());
  result.relative_rmse = std::max(result.relative_rmse, std::sqrt(ratio(sum_error, sum_b)));
  result.psnr = std::min(result.psnr, -10 * std::log10(ratio(mean_square, square(largest))));
  result.identical =
      result.identical && std::memcmp(a.values.data(), b.values.data(), b.values.size() * sizeof(float)) == 0;
}

}  // namespace

ImageDifference compare_images(const Image& a, const Image& b, const std::string& layer) {
  check_comparable(a, b, layer);
  ImageDifference result;
  result.psnr = kInfinity;
  result.identical = true;
  bool found = false;
  for (const Channel& channel : b.channels)
    if (layer_of(channel.name) == layer) {
      compare_channel(b, *find_channel(a, channel.name), channel, result);
      found = true;
    }
  if (!found) fail(ErrorCode::kMismatch, "", "{} is in neither image", describe(layer));
  return result;
}

std::vector<std::string> layer_names(const Image& image) {
  std::vector<std::string> names;
  for (const Channel& channel : image.channels)
    if (const std::string layer(layer_of(channel.name)); std::ranges::find(names, layer) == names.end())
      names.push_back(layer);
  if (const auto beauty = std::ranges::find(names, ""); beauty != names.end())
    std::rotate(names.begin(), beauty, beauty + 1);
  return names;
}

}  // namespace nacre
