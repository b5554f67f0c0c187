// Key frames from JSON.
#include "camera_path.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "json_file.h"
#include "nacre/base/file.h"

namespace nacre::tools {
namespace {

constexpr int kLastFrame = 9'999'999;
constexpr std::size_t kMostBytes = std::size_t{16} << 20, kMostKeys = 10'000;
constexpr double kLargest = 1e12;  // of a coordinate

// What stands there instead of what was wanted.
std::string excerpt(const nlohmann::ordered_json& value) {
  return value.is_primitive() ? value.dump() : std::string(value.type_name());
}

Vec3d read_triple(const nlohmann::ordered_json& value, const std::string& name, const std::string& place) {
  Vec3d triple;
  bool sound = value.is_array() && value.size() == 3;
  for (std::size_t k = 0; sound && k < 3; ++k) {
    sound = value[k].is_number();
    if (sound) triple[static_cast<int>(k)] = value[k].get<double>();
    sound = sound && std::abs(triple[static_cast<int>(k)]) <= kLargest;
  }
  if (!sound)
    fail(ErrorCode::kValue, place, "{} is {}; write three numbers in brackets: [0, 20, 100]", name,
         excerpt(value));
  return triple;
}

CameraKey read_key(const nlohmann::ordered_json& entry, const std::string& place) {
  if (!entry.is_object())
    fail(ErrorCode::kSyntax, place,
         "is no key frame: {{\"frame\": 1, \"origin\": [0, 20, 100], \"target\": [0, 20, 0]}}");
  for (const char* const name : {"frame", "origin", "target"})
    if (!entry.contains(name)) fail(ErrorCode::kSyntax, place, "has no {}", name);
  CameraKey key{};
  for (const auto& [name, value] : entry.items()) {
    if (name == "frame") {
      if (!value.is_number_integer() || value < 0 || value > kLastFrame)
        fail(ErrorCode::kValue, place, "frame {} is not a whole number from 0 to {}", excerpt(value),
             kLastFrame);
      key.frame = value.get<int>();
    } else if (name == "origin") {
      key.origin = read_triple(value, name, place);
    } else if (name == "target") {
      key.target = read_triple(value, name, place);
    } else if (name == "up") {
      key.up = read_triple(value, name, place);
    } else if (name == "fov") {
      if (!value.is_number() || !(value > 0) || !(value < 180))
        fail(ErrorCode::kValue, place, "fov {} is not a number of degrees between 0 and 180", excerpt(value));
      key.fov = value.get<double>();
    } else {
      fail(ErrorCode::kSyntax, place, "'{}' is none of frame, origin, target, up, fov", name);
    }
  }
  if (!is_view(key))
    fail(ErrorCode::kValue, place,
         "origin and target have to differ, and up must not point along the line between them");
  return key;
}

}  // namespace

std::vector<CameraKey> load_camera_path(const std::string& path) {
  const nlohmann::ordered_json json = load_json(path, kMostBytes);
  if (!json.is_array() || json.empty())
    fail(ErrorCode::kSyntax, path, "is no list of key frames: [{{\"frame\": 1, \"origin\": ...}}, ...]");
  if (json.size() > kMostKeys)
    fail(ErrorCode::kLimit, path, "has {} key frames; at most {} will do", json.size(), kMostKeys);
  std::vector<CameraKey> keys;
  for (const nlohmann::ordered_json& entry : json) {
    const std::string place = fmt::format("{}: key frame {}", path, keys.size() + 1);
    keys.push_back(read_key(entry, place));
    if (keys.size() > 1 && keys.back().frame <= keys[keys.size() - 2].frame)
      fail(ErrorCode::kValue, place, "frame {} does not come after frame {}", keys.back().frame,
           keys[keys.size() - 2].frame);
  }
  if (keys.back().frame - keys.front().frame >= kMostFrames)
    fail(ErrorCode::kLimit, path, "goes from frame {} to {}; a film has at most {} frames",
         keys.front().frame, keys.back().frame, kMostFrames);
  return keys;
}

}  // namespace nacre::tools
