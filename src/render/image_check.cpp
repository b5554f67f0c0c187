// Refuses images that are malformed or hold values that are no numbers.
#include "render/image_check.h"

#include <set>

#include "nacre/base/file.h"
#include "nacre/base/parallel.h"

namespace nacre {
namespace {

void check_values(const Image& image, const std::string& path) {
  std::vector<BadValues> bad(image.channels.size());
  parallel_for(bad.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) bad[i] = find_bad_values(image, image.channels[i]);
  });
  std::size_t total = 0;
  for (const BadValues& b : bad) total += b.count;
  if (total == 0) return;
  MappedFile::check_unchanged();  // that would explain them
  const auto first = std::ranges::find_if(bad, [](const BadValues& b) { return b.count > 0; });
  fail(ErrorCode::kValue, path,
       "not written: {} of the image's values {} NaN or infinite, the first in channel {} at pixel ({}, {}); "
       "this is a bug in what made the image",
       total, total == 1 ? "is" : "are", image.channels[static_cast<std::size_t>(first - bad.begin())].name,
       first->x, first->y);
}

}  // namespace

BadValues find_bad_values(const Image& image, const Channel& channel) {
  BadValues bad;
  for (const float v : channel.values) bad.count += !std::isfinite(v);
  if (bad.count == 0) return bad;
  const auto first = static_cast<std::size_t>(
      std::ranges::find_if_not(channel.values, [](float v) { return std::isfinite(v); }) -
      channel.values.begin());
  const auto width = static_cast<std::size_t>(image.width);
  bad.x = image.x + static_cast<int>(first % width);
  bad.y = image.y + static_cast<int>(first / width);
  return bad;
}

void check_image(const Image& image, const std::string& path) {
  constexpr int kFarthest = 1 << 29;  // keeps sums of coordinates inside an int
  if (image.width <= 0 || image.height <= 0 || image.full_width <= 0 || image.full_height <= 0)
    fail(ErrorCode::kValue, path, "not written: {} x {} pixels of a {} x {} frame are no image", image.width,
         image.height, image.full_width, image.full_height);
  const std::int64_t pixels = std::int64_t{image.width} * image.height;
  if (pixels > kMaxImagePixels || image.full_width > kFarthest || image.full_height > kFarthest ||
      std::abs(std::int64_t{image.x}) > kFarthest || std::abs(std::int64_t{image.y}) > kFarthest)
    fail(ErrorCode::kLimit, path, "not written: {} x {} pixels at ({}, {}) are more than the {} that fit",
         image.width, image.height, image.x, image.y, kMaxImagePixels);
  if (image.channels.empty()) fail(ErrorCode::kValue, path, "not written: the image has no channels");
  std::set<std::string> names;
  for (const Channel& channel : image.channels) {
    if (channel.name.empty() || channel.name.size() > 255 || channel.name.find('\0') != std::string::npos)
      fail(ErrorCode::kValue, path, "not written: a channel's name has 1 to 255 characters, '{}' has not",
           channel.name);
    if (!names.insert(channel.name).second)
      fail(ErrorCode::kValue, path, "not written: channel {} is there twice", channel.name);
    if (channel.values.size() != static_cast<std::size_t>(pixels))
      fail(ErrorCode::kValue, path, "not written: channel {} has {} values for {} pixels", channel.name,
           channel.values.size(), pixels);
  }
  check_values(image, path);
}

}  // namespace nacre
