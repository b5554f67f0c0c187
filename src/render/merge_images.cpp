// Parts of a picture, checked and copied row by row.
#include "nacre/render/merge_images.h"

#include <algorithm>
#include <map>

#include "render/image_check.h"

namespace nacre {
namespace {

struct Part {
  std::string path;
  int x = 0, y = 0, width = 0, height = 0;
};

std::vector<std::string> sorted_names(const Image& image) {
  std::vector<std::string> names;
  for (const Channel& channel : image.channels) names.push_back(channel.name);
  std::ranges::sort(names);
  return names;
}

// Without what is of a part alone.
std::map<std::string, std::string> common_metadata(const Image& image) {
  std::map<std::string, std::string> metadata = image.metadata;
  for (const char* const own : {"nacre:command", "nacre:key", kDigestKey}) metadata.erase(own);
  return metadata;
}

Image make_frame(const Image& part, const std::string& path) {
  if (std::int64_t{part.full_width} * part.full_height > kMaxImagePixels)
    fail(ErrorCode::kLimit, path, "is of a frame of {} x {} pixels, more than the {} that fit",
         part.full_width, part.full_height, kMaxImagePixels);
  Image frame{part.full_width, part.full_height, 0, 0, part.full_width, part.full_height, {}, part.metadata};
  const auto pixels = static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
  for (const Channel& channel : part.channels)
    frame.channels.push_back({channel.name, std::vector<float>(pixels)});
  return frame;
}

void check_same_picture(const Image& part, const std::string& path, const Image& frame,
                        const std::string& first) {
  if (part.full_width != frame.full_width || part.full_height != frame.full_height)
    fail(ErrorCode::kMismatch, path, "is of a frame of {} x {} pixels, {} of one of {} x {}", part.full_width,
         part.full_height, first, frame.full_width, frame.full_height);
  if (sorted_names(part) != sorted_names(frame))
    fail(ErrorCode::kMismatch, path, "has other channels than {}", first);
  const auto here = common_metadata(part), there = common_metadata(frame);
  for (const auto* const from : {&here, &there})
    for (const auto& [name, value] : *from) {
      const auto a = here.find(name), b = there.find(name);
      if (a == here.end() || b == there.end() || a->second != b->second)
        fail(ErrorCode::kMismatch, path, "is no part of the same picture as {}: {} differs", first, name);
    }
}

void check_place(const Part& part, const Image& frame, const std::vector<Part>& others) {
  if (part.x < 0 || part.y < 0 || part.width > frame.width - part.x || part.height > frame.height - part.y)
    fail(ErrorCode::kMismatch, part.path, "reaches outside its frame of {} x {} pixels", frame.width,
         frame.height);
  for (const Part& other : others)
    if (part.x < other.x + other.width && other.x < part.x + part.width && part.y < other.y + other.height &&
        other.y < part.y + part.height)
      fail(ErrorCode::kMismatch, part.path, "overlaps {}", other.path);
}

void copy_part(const Image& part, Image& frame, std::vector<bool>& covered) {
  for (int row = 0; row < part.height; ++row) {
    const auto from = std::ptrdiff_t{row} * part.width;
    const auto to = std::ptrdiff_t{part.y + row} * frame.width + part.x;
    for (Channel& channel : frame.channels)
      std::copy_n(find_channel(part, channel.name)->values.begin() + from, part.width,
                  channel.values.begin() + to);
    std::fill_n(covered.begin() + to, part.width, true);
  }
}

void check_covered(const std::vector<bool>& covered, const Image& frame, const std::vector<Part>& parts) {
  const auto hole = std::ranges::find(covered, false) - covered.begin();
  if (hole == std::ssize(covered)) return;
  fail(ErrorCode::kMismatch, parts[0].path,
       "{} of the {} x {} pixels of the picture are in no part, the first of them ({}, {})",
       std::ranges::count(covered, false), frame.width, frame.height, hole % frame.width, hole / frame.width);
}

}  // namespace

Image merge_images(const std::vector<std::string>& paths) {
  Image frame;
  std::vector<bool> covered;
  std::vector<Part> parts;
  for (const std::string& path : paths) {
    const Image part = load_exr(path);
    if (check_seal(part) == Seal::kBroken)
      fail(ErrorCode::kDamaged, path,
           "is not as nacre wrote it: damaged, or changed by another program; render it again");
    if (parts.empty()) {
      frame = make_frame(part, path);
      covered.resize(static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height));
    } else {
      check_same_picture(part, path, frame, paths[0]);
    }
    const Part place{path, part.x, part.y, part.width, part.height};
    check_place(place, frame, parts);
    copy_part(part, frame, covered);
    parts.push_back(place);
  }
  if (!parts.empty()) check_covered(covered, frame, parts);
  for (const char* const own : {kSettingsKey, "nacre:key"}) frame.metadata.erase(own);
  return frame;
}

}  // namespace nacre
