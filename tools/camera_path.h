// Key frames of a camera in a file.
#pragma once

#include <string>
#include <vector>

#include "nacre/scene/camera_motion.h"

namespace nacre::tools {

inline constexpr int kMostFrames = 100'000;  // of a film

/// A list of key frames: [{"frame": 1, "origin": [x, y, z], "target": [x, y, z], "up": [0, 1, 0], "fov": 30},
/// ...], up and fov where wanted. Throws Error with `path` and the line or the key.
std::vector<CameraKey> load_camera_path(const std::string& path);

}  // namespace nacre::tools
